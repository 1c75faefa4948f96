// Other projects' test files, and real models: each is read, or refused in one clear line, within 10 s of processor
// time and 1 GiB. Each in a process of its own, so that a crash names its file.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "tests/support/mesh_reading.h"

namespace vcp {
namespace {

// What the first byte of a child's answer means.
constexpr char kRead = 'r', kRefused = 'e', kBroken = 'b';

std::string readToTheEnd(const std::filesystem::path& path) {
    auto stream = openMesh(path);
    if (!stream) return kRefused + stream.error().line();
    MeshChunk chunk;
    uint64_t vertices = 0, triangles = 0;
    while (true) {
        const auto more = (*stream)->next(chunk);
        if (!more) return kRefused + more.error().line();
        if (!*more) break;
        vertices += chunk.positions.size();
        triangles += chunk.triangles.size();
        const MeshInfo& info = (*stream)->info();
        if (chunk.colours.size() != (info.hasColour ? chunk.positions.size() : 0))
            return kBroken + std::string("colours");
        if (chunk.uvs.size() != chunk.materials.size()) return kBroken + std::string("uvs");
        if (!chunk.uvs.empty() && chunk.uvs.size() != chunk.triangles.size())
            return kBroken + std::string("uvs of triangles");
        for (const uint32_t material : chunk.materials)
            if (material != kNoMaterial && material >= (*stream)->materials().size())
                return kBroken + std::string("materials");
    }
    const auto& declared = (*stream)->info().vertices;
    if (declared && *declared != vertices) return kBroken + std::string("declared vertices");
    std::string text = kRead + std::to_string(triangles) + " triangles, " + std::to_string(vertices) + " vertices, " +
                       (*stream)->info().format;
    if ((*stream)->info().hasColour) text += ", colours";
    if ((*stream)->info().hasMaterials) text += ", " + std::to_string((*stream)->materials().size()) + " materials";
    for (const std::string& warning : (*stream)->warnings()) text += "; warning: " + warning;
    return text;
}

void limit(decltype(RLIMIT_AS) what, uint64_t value) {
    const rlimit bounds{value, value};
    ::setrlimit(what, &bounds);
}

struct Answer {
    std::string text;  // empty when the process died
    int status = 0;
};

Answer readInAProcess(const std::filesystem::path& path) {
    int ends[2];
    if (::pipe(ends) != 0) return {};
    const pid_t child = ::fork();
    if (child == 0) {
        ::close(ends[0]);
        limit(RLIMIT_CPU, 10);
#ifdef VCP_LIMIT_MEMORY
        limit(RLIMIT_AS, uint64_t{1} << 30);
#endif
        const std::string text = readToTheEnd(path);
        const ssize_t put = ::write(ends[1], text.data(), std::min<size_t>(text.size(), 60'000));
        ::_exit(put > 0 ? 0 : 1);
    }
    ::close(ends[1]);
    Answer answer;
    char buffer[4096];
    ssize_t got = 0;
    while ((got = ::read(ends[0], buffer, sizeof buffer)) > 0) answer.text.append(buffer, size_t(got));
    ::close(ends[0]);
    ::waitpid(child, &answer.status, 0);
    return answer;
}

TEST(Suites, EveryFileIsReadOrRefusedInOneLine) {
    std::vector<std::filesystem::path> files;
    for (const char* folder : {"suites", "draco", "scans", "scenes", "colour", "terrain"}) {
        std::error_code absent;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(test::kSharedData / folder, absent))
            if (entry.is_regular_file()) files.push_back(entry.path());
    }
    if (files.empty()) GTEST_SKIP() << "no mesh suites in " << test::kSharedData;
    std::ranges::sort(files);
    size_t read = 0;
    const bool verbose = std::getenv("VCP_SUITES_VERBOSE");
    for (const auto& path : files) {
        const Answer answer = readInAProcess(path);
        EXPECT_EQ(answer.status, 0) << path << " ended its process";
        ASSERT_FALSE(answer.text.empty()) << path;
        EXPECT_NE(answer.text[0], kBroken) << path << ": " << answer.text;
        EXPECT_EQ(answer.text.find('\n'), std::string::npos) << answer.text;
        if (answer.text[0] == kRefused) {
            EXPECT_NE(answer.text.find(path.filename().string()), std::string::npos) << "no file in: " << answer.text;
        }
        read += answer.text[0] == kRead;
        if (verbose) std::cout << path.lexically_relative(test::kSharedData).string() << ": " << answer.text << '\n';
    }
    EXPECT_GE(read, 340u) << "of " << files.size();
}

}  // namespace
}  // namespace vcp
