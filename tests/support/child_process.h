#pragma once

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>
#include <vector>

namespace crumple::test {

// A program of ours with its standard output on a pipe; killed when it goes out of scope.
class ChildProcess {
 public:
  explicit ChildProcess(std::vector<std::string> command) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    std::vector<char*> arguments;
    for (std::string& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    if (posix_spawn(&pid_, arguments[0], &actions, nullptr, arguments.data(), environ) != 0) pid_ = -1;
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    out_ = ends[0];
  }
  ~ChildProcess() {
    if (pid_ > 0) end(SIGKILL);
    if (out_ >= 0) close(out_);
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  bool started() const { return pid_ > 0; }

  // The next line without its end; what came until then if the output ends, or after 120 s.
  std::string read_line() {
    std::string line;
    char c = 0;
    pollfd ready{out_, POLLIN, 0};
    while (poll(&ready, 1, 120'000) == 1 && read(out_, &c, 1) == 1 && c != '\n') line += c;
    return line;
  }

  // Sends the signal and waits. The exit code, or minus the signal that ended it.
  int end(int signal) {
    kill(pid_, signal);
    return wait();
  }
  // Waits for its end, 120 s at most: then it is killed.
  int wait() {
    char rest[256];
    pollfd ready{out_, POLLIN, 0};
    ssize_t count = 1;
    while (count > 0 && poll(&ready, 1, 120'000) == 1) count = read(out_, rest, sizeof rest);
    if (count > 0) kill(pid_, SIGKILL);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  pid_t pid_ = -1;
  int out_ = -1;
};

inline std::string program(const std::string& name) { return std::string(CRUMPLE_BINARY_DIR) + "/bin/" + name; }

}  // namespace crumple::test
