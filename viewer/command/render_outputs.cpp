#include "viewer/command/render_outputs.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace vcp {

namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "{}";

std::string nameOfInput(const std::string& input) {
    fs::path name = fs::path(input.substr(0, input.find_first_of("?#"))).filename();
    if (name.extension() == ".gz" || name.extension() == ".zst") name = name.stem();
    name = name.stem();
    return name.empty() ? "picture" : name.string();
}

}  // namespace

bool isForEachInput(const std::string& output) {
    std::error_code failed;
    return output.find(kName) != std::string::npos || output.ends_with('/') || fs::is_directory(output, failed);
}

std::string outputFor(const std::string& output, const std::string& input) {
    const std::string name = nameOfInput(input);
    std::string file = output;
    const size_t first = file.find(kName);
    if (first == std::string::npos) return (fs::path(output) / (name + ".png")).string();
    for (size_t at = first; at != std::string::npos; at = file.find(kName, at + name.size())) file.replace(at, 2, name);
    return file;
}

Result<std::vector<std::string>> outputsFor(const std::string& output, const std::vector<std::string>& inputs) {
    std::vector<std::string> outputs;
    for (const std::string& input : inputs) {
        outputs.push_back(outputFor(output, input));
        const auto before = std::find(outputs.begin(), outputs.end() - 1, outputs.back());
        if (before != outputs.end() - 1)
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format("{} and {} would both be drawn into {}; give them names of their own",
                                                inputs[size_t(before - outputs.begin())], input, outputs.back())};
    }
    return outputs;
}

}  // namespace vcp
