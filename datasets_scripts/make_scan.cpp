// make_scan: writes a procedural scan of any size as a binary PLY file, or a dog as an OBJ, to a file or a pipe; or a
// scan with a picture, as an OBJ with what belongs to it.
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "datasets_scripts/dog.h"
#include "datasets_scripts/scan_mesh.h"
#include "datasets_scripts/test_picture.h"
#include "octree/io/durable_file.h"
#include "octree/io/output_file.h"

namespace {

using namespace vcp;
using namespace vcp::scan;

constexpr std::string_view kHelp =
    "make_scan: writes a procedural statue as a binary PLY file, as a scanner might have left it:\n"
    "carved, noisy, with thin parts, slivers, an open border, holes and overlapping passes.\n"
    "\n"
    "usage: make_scan [--shape statue|dog] [--triangles N] [--seed S] [--colour] [--utm] [--texture EDGE [--jpeg]]\n"
    "                 [--parts] -o FILE|-\n"
    "\n"
    "  --shape dog    a dog as an OBJ with texture coordinates, to lay mesostructure on: about N triangles, 10k to "
    "200k,\n"
    "                 always the same one\n"
    "  --triangles N  exactly so many triangles, 10k to 1G (500k)\n"
    "  --seed S       another pose, other folds, other stone (1); the same seed gives the same bytes\n"
    "  --colour       vertex colours\n"
    "  --utm          double positions, z up, with an origin in UTM coordinates\n"
    "  --texture EDGE an OBJ with its MTL and a picture of EDGE x EDGE texels (256 to 32768) in cells with their\n"
    "                 numbers: -o scan.obj writes scan.mtl and scan.png, too; without --colour and --utm\n"
    "  --jpeg         scan.jpg instead\n"
    "  --parts        prints the parts and their counts on stderr\n"
    "  -o FILE|-      the file to write, or - for a pipe\n"
    "  --help         this text\n"
    "\n"
    "Memory does not grow with N. Exit status: 0 done, 1 failed, 2 wrong usage.\n";

struct Arguments {
    ScanOptions scan;
    std::string out;
    uint32_t pictureEdge = 0;  ///< texels; 0: no picture
    PictureKind picture = PictureKind::Png;
    bool help = false, parts = false, isDog = false,
         isStatueOnly = false;  ///< isStatueOnly: an option of the statue was given
};

Result<uint64_t> number(std::string_view option, std::string_view text, uint64_t least, uint64_t most) {
    uint64_t value = 0;
    auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (const std::string_view unit(end, text.data() + text.size()); problem == std::errc() && unit.size() == 1) {
        const uint64_t factor = unit == "k" ? 1'000 : unit == "M" ? 1'000'000 : unit == "G" ? 1'000'000'000 : 0;
        if (factor > 0 && value <= most / factor) value *= factor, ++end;
    }
    if (problem != std::errc() || end != text.data() + text.size() || value < least || value > most)
        return Error{.code = ErrorCode::Usage,
                     .message = std::string(option) + " wants a whole number from " + std::to_string(least) + " to " +
                                std::to_string(most) + ", not '" + std::string(text) + "'"};
    return value;
}

Result<Arguments> parse(int argc, char** argv) {
    Arguments arguments;
    for (int i = 1; i < argc; ++i) {
        const std::string_view option = argv[i];
        const bool takesValue = option == "--shape" || option == "--triangles" || option == "--seed" ||
                                option == "--texture" || option == "-o";
        if (takesValue && i + 1 == argc)
            return Error{.code = ErrorCode::Usage, .message = std::string(option) + " wants a value"};
        arguments.isStatueOnly = arguments.isStatueOnly || option == "--seed" || option == "--colour" ||
                                 option == "--utm" || option == "--parts" || option == "--texture" ||
                                 option == "--jpeg";
        if (option == "--help" || option == "-h")
            arguments.help = true;
        else if (option == "--colour")
            arguments.scan.colour = true;
        else if (option == "--utm")
            arguments.scan.utm = true;
        else if (option == "--parts")
            arguments.parts = true;
        else if (option == "--jpeg")
            arguments.picture = PictureKind::Jpeg;
        else if (option == "-o")
            arguments.out = argv[++i];
        else if (option == "--shape") {
            const std::string_view shape = argv[++i];
            if (shape != "statue" && shape != "dog")
                return Error{.code = ErrorCode::Usage,
                             .message = "--shape is statue or dog, not '" + std::string(shape) + "'"};
            arguments.isDog = shape == "dog";
        } else if (option == "--triangles") {
            VCP_TRY_ASSIGN(arguments.scan.triangles, number(option, argv[++i], kMinTriangles, kMaxTriangles));
        } else if (option == "--seed") {
            VCP_TRY_ASSIGN(arguments.scan.seed, number(option, argv[++i], 0, UINT64_MAX));
        } else if (option == "--texture") {
            VCP_TRY_ASSIGN(const uint64_t edge, number(option, argv[++i], kMinPictureEdge, kMaxPictureEdge));
            arguments.pictureEdge = uint32_t(edge);
        } else
            return Error{.code = ErrorCode::Usage,
                         .message = "unknown option '" + std::string(option) + "'; see make_scan --help"};
    }
    if (!arguments.help && arguments.out.empty())
        return Error{.code = ErrorCode::Usage, .message = "-o FILE is missing (or -o - for a pipe)"};
    if (arguments.isDog && arguments.isStatueOnly)
        return Error{.code = ErrorCode::Usage,
                     .message = "--seed, --colour, --utm, --texture, --jpeg and --parts are of the statue"};
    if (arguments.picture == PictureKind::Jpeg && arguments.pictureEdge == 0)
        return Error{.code = ErrorCode::Usage, .message = "--jpeg wants --texture EDGE"};
    if (arguments.pictureEdge > 0 && (arguments.scan.colour || arguments.scan.utm || arguments.out == "-"))
        return Error{.code = ErrorCode::Usage, .message = "--texture goes without --colour, --utm and a pipe"};
    if (arguments.isDog && arguments.scan.triangles > kMostDogTriangles)
        return Error{.code = ErrorCode::Usage,
                     .message = "a dog has at most " + std::to_string(kMostDogTriangles) + " triangles"};
    return arguments;
}

Error ioError(const std::string& file, const std::string& what) {
    return {ErrorCode::Io, what + ": " + std::strerror(errno), file};
}

/// A file that appears under its name only when it is whole; or standard output, a pipe or a device, written directly.
class Output {
public:
    static Result<Output> open(const std::string& path, OutputKind kind) {
        Output output;
        output.path_ = path;
        struct stat status {};
        const bool isThere = ::stat(path.c_str(), &status) == 0;
        if (path == "-") {
            output.descriptor_ = STDOUT_FILENO;
        } else if (isThere && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)) {
            output.descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
            if (output.descriptor_ < 0) return ioError(path, "cannot be written");
        } else {
            VCP_TRY_ASSIGN(auto file, OutputFile::create(path, kind));
            output.file_ = std::make_unique<OutputFile>(std::move(file));
        }
        return output;
    }

    Result<void> write(std::span<const std::byte> bytes) const {
        return file_ ? file_->append(bytes) : appendAll(descriptor_, bytes, path_);
    }

    /// Gives the finished file its name.
    Result<void> finish() const {
        if (file_) return file_->commit();
        if (::close(descriptor_) != 0) return ioError(path_, "close failed");
        return {};
    }

private:
    std::string path_;
    std::unique_ptr<OutputFile> file_;
    int descriptor_ = -1;
};

void printParts(const ScanMesh& mesh) {
    for (const GridPart& grid : mesh.parts())
        std::fprintf(stderr, "%-24s %-6s %10llu vertices %10llu triangles\n", grid.part.name.c_str(),
                     grid.part.closed() ? "closed" : "open", static_cast<unsigned long long>(grid.vertices),
                     static_cast<unsigned long long>(grid.triangles));
}

Result<void> writeStatue(const Arguments& arguments, const Output& output) {
    const ScanMesh mesh(arguments.scan);
    if (arguments.parts) printParts(mesh);
    return mesh.writePly([&](std::span<const std::byte> bytes) { return output.write(bytes); });
}

/// Whether there is a JPEG of that name, which may be replaced.
bool isJpegFile(const std::filesystem::path& path) {
    std::array<char, 2> begin{};
    std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
    return begin == std::array<char, 2>{'\xFF', '\xD8'};
}

/// Writes the picture and the material that has it.
Result<void> writePicture(const Arguments& arguments) {
    const bool isPng = arguments.picture == PictureKind::Png;
    std::filesystem::path picture = arguments.out, materials = arguments.out;
    picture.replace_extension(isPng ? ".png" : ".jpg");
    materials.replace_extension(".mtl");
    VCP_TRY_ASSIGN(auto file,
                   OutputFile::create(picture, OutputKind::Png, {.overwrite = !isPng && isJpegFile(picture)}));
    VCP_TRY(writeTestPicture(arguments.pictureEdge, arguments.picture,
                             [&](std::span<const std::byte> bytes) { return file.append(bytes); }));
    VCP_TRY(file.commit());
    VCP_TRY_ASSIGN(auto text, OutputFile::create(materials, OutputKind::Text));
    const std::string lines = "newmtl scan\nKd 1 1 1\nmap_Kd " + picture.filename().string() + "\n";
    VCP_TRY(text.append(std::as_bytes(std::span(lines))));
    return text.commit();
}

Result<void> writeTextured(const Arguments& arguments, const Output& output) {
    const ScanMesh mesh(arguments.scan);
    if (arguments.parts) printParts(mesh);
    VCP_TRY(writePicture(arguments));
    const std::string materials = std::filesystem::path(arguments.out).replace_extension(".mtl").filename().string();
    return mesh.writeObj([&](std::span<const std::byte> bytes) { return output.write(bytes); }, materials);
}

Result<void> run(const Arguments& arguments) {
    const bool isObj = arguments.isDog || arguments.pictureEdge > 0;
    const OutputKind kind = isObj ? OutputKind::Obj : OutputKind::Ply;
    if (const auto named = outputKindOf(arguments.out); named && *named != kind)
        return Error{.code = ErrorCode::Usage,
                     .message = std::string("what is written is ") +
                                (isObj ? "an OBJ: -o must end in .obj" : "a PLY: -o must end in .ply") +
                                ", or be - for a pipe"};
    VCP_TRY_ASSIGN(auto output, Output::open(arguments.out, kind));
    auto result = arguments.isDog
                      ? writeObj(dog(arguments.scan.triangles),
                                 [&](std::string_view text) { return output.write(std::as_bytes(std::span(text))); })
                  : arguments.pictureEdge > 0 ? writeTextured(arguments, output)
                                              : writeStatue(arguments, output);
    if (result) result = output.finish();
    return result;
}

}  // namespace

int main(int argc, char** argv) {
    // A reader that closes the pipe is an error to report, not a reason to die silently.
    std::signal(SIGPIPE, SIG_IGN);
    const auto arguments = parse(argc, argv);
    if (!arguments) {
        std::fprintf(stderr, "make_scan: %s\n", arguments.error().line().c_str());
        return 2;
    }
    if (arguments->help) {
        std::fwrite(kHelp.data(), 1, kHelp.size(), stdout);
        return 0;
    }
    if (const auto result = run(*arguments); !result) {
        std::fprintf(stderr, "make_scan: %s\n", result.error().line().c_str());
        return result.error().code == ErrorCode::Usage ? 2 : 1;
    }
    return 0;
}
