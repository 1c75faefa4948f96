// A script in the place of ffmpeg, for tests of videos.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace vcp::test {

/// Puts a script first where programs are looked for, as `ffmpeg`, as long as it lives.
class EncoderInPath {
public:
    /// Writes "1234ftyp", which videos begin with, and then the frames as they come.
    static constexpr const char* kCopies = "(printf 1234ftyp; cat) >/dev/fd/3\n";

    /// `folder`: an existing one, in which bin/ffmpeg is made.
    explicit EncoderInPath(const std::filesystem::path& folder, const std::string& script = kCopies)
        : before_(std::getenv("PATH")) {
        const std::filesystem::path bin = folder / "bin", program = bin / "ffmpeg";
        std::filesystem::create_directory(bin);
        std::ofstream(program) << "#!/bin/sh\n" << script;
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
        setenv("PATH", (bin.string() + ":" + before_).c_str(), 1);
    }
    ~EncoderInPath() { setenv("PATH", before_.c_str(), 1); }
    EncoderInPath(const EncoderInPath&) = delete;
    EncoderInPath& operator=(const EncoderInPath&) = delete;

private:
    std::string before_;
};

}  // namespace vcp::test
