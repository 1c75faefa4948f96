// vcp bench picture and vcp bench colour: what is drawn against pictures of the mesh itself.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "octree/vcp_file.h"
#include "render/pixel_samples.h"
#include "viewer/bench/picture/bench_colour.h"
#include "viewer/bench/picture/bench_picture.h"
#include "viewer/bench/rays/bench_cameras.h"
#include "viewer/command/bench_command.h"
#include "viewer/command/parsed_option.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct PictureCommand : BenchCommand {
    BenchPictureOptions options;
    glm::ivec2 size{960, 600};
};

struct ColourCommand : BenchCommand {
    BenchColourOptions options;
    glm::ivec2 size{960, 600};
};

Result<int> runPicture(const PictureCommand& command) {
    VCP_TRY(makeFolder(command.out));
    BenchPictureOptions options = command.options;
    takeShared(command, options);
    options.size = command.size;
    VCP_TRY_ASSIGN(const auto report, runShown(command, benchPicture, options, options.progress));
    return publish(
        command, "bench_picture",
        {benchPictureJson(report), benchPictureCsv(report), benchPictureMarkdown(report), benchPicturePlots(report)});
}

Result<int> runColour(const ColourCommand& command) {
    VCP_TRY(makeFolder(command.out));
    BenchColourOptions options = command.options;
    takeShared(command, options);
    options.size = command.size;
    VCP_TRY_ASSIGN(const auto report, runShown(command, benchColour, options, options.progress));
    return publish(
        command, "bench_colour",
        {benchColourJson(report), benchColourCsv(report), benchColourMarkdown(report), benchColourPlots(report)});
}

void addNames(CLI::App& app, const char* name, std::vector<std::string>& values, const std::string& text) {
    app.add_option(name, values, text)->type_name("A,B")->delimiter(',')->allow_extra_args(false);
}

void addNumber(CLI::App& app, const char* name, int& value, const char* text, int most) {
    app.add_option(name, value, text)->type_name("N")->capture_default_str()->check(CLI::Range(1, most));
}

/// Adds what both benches are asked in the same words.
template <class Options>
void addPictureOptions(CLI::App& app, Options& options, glm::ivec2& size) {
    app.add_option("--error-pixels", options.errorPixels, "Errors that a picture may have, in pixels: 0.25,0.5,1")
        ->type_name("X,X")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str()
        ->check(CLI::Range(0.01, 1000.0));
    addSize(app, size, "960x600", "Width and height in pixels")->default_str(sizeText(size));
    addNumber(app, "--views", options.views, "Directions that each camera looks from", 1000);
    addNumber(app, "--samples", options.samples, "The mesh's picture has N x N rays a pixel", 64);
    app.add_option("--device", options.device,
                   "Vulkan device of the method certified, see `vcp devices` [the best one]")
        ->type_name("DEVICE");
}

}  // namespace

RunCommand addBenchPicture(CLI::App& bench) {
    auto command = std::make_shared<PictureCommand>();
    BenchPictureOptions& options = command->options;
    CLI::App* app = bench.add_subcommand("picture", "Compare pictures with many samples a pixel of the mesh itself");
    addBenchOptions(
        *app, *command,
        "Meshes, or .vcp files beside the meshes they were built from [a sphere, a torus and a thin plate]");
    addNames(*app, "--methods", options.methods, fmt::format("{} [all]", fmt::join(pictureMethodNames(), ", ")));
    addNames(*app, "--cameras", options.cameras,
             fmt::format("{} [all]; dive goes from whole to a cell of {:g} pixels",
                         fmt::join(pictureCameraNames(), ", "), kDiveCellPixels));
    addPictureOptions(*app, options, command->size);
    addNumber(*app, "--dive-steps", options.diveSteps, "Frames of the dive", 1000);
    app->add_option("--picture-samples", options.pictureSamples, "Rays a pixel of certified, as vcp render --samples")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, int(kMostSamples)));
    app->add_flag("--pictures", options.pictures, "Also write the pictures into --out, with isolated pixels in red");
    return [command] { return runPicture(*command); };
}

RunCommand addBenchColour(CLI::App& bench) {
    auto command = std::make_shared<ColourCommand>();
    BenchColourOptions& options = command->options;
    CLI::App* app = bench.add_subcommand("colour", "Compare colours with those of the textured mesh itself");
    addBenchOptions(*app, *command,
                    "Meshes with colours or textures, or .vcp files beside the meshes they were built from [a wall and "
                    "waves with a texture]");
    addNames(*app, "--methods", options.methods, fmt::format("{} [all]", fmt::join(colourMethodNames(), ", ")));
    addNames(*app, "--cameras", options.cameras,
             fmt::format("{} [whole, half, close]; dive goes from whole to a cell of {:g} pixels",
                         fmt::join(colourCameraNames(), ", "), kDiveCellPixels));
    addNumber(*app, "--dive-steps", options.diveSteps, "Frames of the dive", 1000);
    addPictureOptions(*app, options, command->size);
    app->add_option("--colour-error", options.colourErrors,
                    "Differences of colours that a picture may have, as \u0394E: 1,2,4")
        ->type_name("X,X")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str()
        ->check(CLI::Range(0.0, kMostColourError));
    addNumber(*app, "--picture-samples", options.pictureSamples, "All pictures compared have N x N rays a pixel", 8);
    app->add_flag("--images,!--no-images", options.images, "Keep images in what is built, and draw from them [on]");
    app->add_flag("--pictures", options.pictures, "Also write the pictures into --out");
    return [command] { return runColour(*command); };
}

}  // namespace vcp
