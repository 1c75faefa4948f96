#include "tests/support/vcp_program.h"

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <sstream>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace vcp {

pid_t VcpProgram::start(const std::vector<std::string>& arguments, const std::string& out, bool smallFiles) const {
    const std::filesystem::path outFile = out[0] == '/' ? std::filesystem::path(out) : folder_ / out,
                                errFile = folder_ / "stderr";
    const pid_t child = fork();
    if (child != 0) return child;
    dup2(open(outFile.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
    dup2(open(errFile.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
    setenv("XDG_CACHE_HOME", (folder_ / "cache").c_str(), 1);
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    if (smallFiles) {
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{8192, 8192};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    std::vector<char*> argv = {const_cast<char*>("vcp")};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    execv(VCP_EXECUTABLE, argv.data());
    _exit(127);
}

Ran VcpProgram::runWords(const std::string& words) const {
    std::istringstream stream(words);
    return run({std::istream_iterator<std::string>(stream), {}});
}

Ran VcpProgram::wait(pid_t child) const {
    Ran ran;
    int status = 0;
    waitpid(child, &status, 0);
    ran.status = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    ran.out = contentOf(folder_ / "stdout");
    ran.err = contentOf(folder_ / "stderr");
    return ran;
}

}  // namespace vcp
