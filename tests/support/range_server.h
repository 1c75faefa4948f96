// Starts range_server.py on a free port of the loopback; it ends with this object.
#pragma once

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace vcp::test {

class RangeServer {
public:
    /// `tls`: certificate and key, as paths; empty: plain http.
    explicit RangeServer(const std::filesystem::path& folder, const std::vector<std::string>& tls = {})
        : tls_(!tls.empty()) {
        // What is asked here stays on this machine.
        for (const char* name : {"http_proxy", "https_proxy", "all_proxy", "HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"})
            ::unsetenv(name);
        int out[2];
        if (::pipe(out) != 0) return;
        std::vector<std::string> words = {"python3", VCP_SOURCE_DIR "/tests/support/range_server.py", folder.string()};
        words.insert(words.end(), tls.begin(), tls.end());
        child_ = ::fork();
        if (child_ == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            ::dup2(out[1], STDOUT_FILENO);
            std::vector<char*> argv;
            for (std::string& word : words) argv.push_back(word.data());
            argv.push_back(nullptr);
            ::execvp(argv[0], argv.data());
            ::_exit(127);
        }
        ::close(out[1]);
        FILE* lines = ::fdopen(out[0], "r");
        if (std::fscanf(lines, "port %d", &port_) != 1)
            ADD_FAILURE() << "python3 with tests/support/range_server.py does not start";
        std::fclose(lines);
    }
    ~RangeServer() {
        if (child_ <= 0) return;
        ::kill(child_, SIGKILL);
        ::waitpid(child_, nullptr, 0);
    }
    RangeServer(const RangeServer&) = delete;
    RangeServer& operator=(const RangeServer&) = delete;

    [[nodiscard]] bool runs() const { return port_ > 0; }
    /// Address of a file, such as "scan.vcp?fault=short".
    [[nodiscard]] std::string url(const std::string& file) const {
        return std::string(tls_ ? "https" : "http") + "://127.0.0.1:" + std::to_string(port_) + "/" + file;
    }

private:
    bool tls_;
    pid_t child_ = -1;
    int port_ = 0;
};

}  // namespace vcp::test
