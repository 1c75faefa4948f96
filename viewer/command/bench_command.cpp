#include "viewer/command/bench_command.h"

#include "octree/io/output_file.h"
#include "viewer/command/parsed_option.h"

namespace vcp {

Result<void> makeFolder(const std::string& folder) {
    std::error_code failed;
    if (!folder.empty()) std::filesystem::create_directories(folder, failed);
    if (failed)
        return Error{
            .code = ErrorCode::Io, .message = "the folder cannot be made: " + failed.message(), .file = folder};
    return {};
}

Result<int> publish(const BenchCommand& command, const std::string& name, const BenchTexts& texts) {
    if (!command.out.empty()) {
        const std::filesystem::path folder = command.out;
        const OutputRules rules{.overwrite = command.overwrite, .inputs = command.modelPaths()};
        VCP_TRY(writeFile(folder / (name + ".json"), OutputKind::JsonText, texts.json, rules));
        VCP_TRY(writeFile(folder / (name + ".csv"), OutputKind::Text, texts.csv, rules));
        VCP_TRY(writeFile(folder / (name + ".md"), OutputKind::Text, texts.markdown, rules));
        for (const auto& [plot, svg] : texts.plots)
            VCP_TRY(writeFile(folder / (plot + ".svg"), OutputKind::Svg, svg, rules));
    }
    VCP_TRY(command.report.json ? printJsonText(texts.json) : printLine(texts.markdown));
    return 0;
}

void addBenchOptions(CLI::App& app, BenchCommand& command, const std::string& models) {
    app.add_option("MODEL", command.models, models)->type_name("");
    app.add_option("--out", command.out,
                   "Folder for the report as JSON, CSV, Markdown and plots, and for what is built")
        ->type_name("DIR");
    addOverwriteOption(app, command.overwrite);
    app.add_option("--repetitions", command.repetitions, "Runs whose median is reported")
        ->type_name("N")
        ->check(CLI::Range(1, 1000));
    addCell(app, command.cell);
    app.add_option("--threads", command.threads, "Threads [one a processor]")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    addProgressOption(app, command.report);
    addJsonOption(app, command.report);
}

}  // namespace vcp
