#include "server/lab/stability/isolated.h"

#include "common/text.h"

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <iostream>

namespace crumple::lab::stability {

namespace {

void write_all(int file, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = write(file, bytes.data() + done, bytes.size() - done);
    if (count <= 0) return;
    done += static_cast<std::size_t>(count);
  }
}

}  // namespace

Isolated run_isolated(const std::function<std::string()>& work, int limit_seconds) {
  Isolated result;
  const auto start = std::chrono::steady_clock::now();
  int ends[2];
  if (pipe(ends) != 0) return {.ending = "no pipe"};
  std::cout.flush();
  std::cerr.flush();
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    alarm(static_cast<unsigned>(limit_seconds));
    write_all(ends[1], work());
    _exit(0);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    return {.ending = "no process"};
  }
  char buffer[4096];
  for (ssize_t count; (count = read(ends[0], buffer, sizeof buffer)) > 0;)
    result.answer.append(buffer, static_cast<std::size_t>(count));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  result.finished = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  if (WIFSIGNALED(status))
    result.ending = WTERMSIG(status) == SIGALRM ? text("no answer within ", limit_seconds, " s")
                                                : text("ended by signal ", WTERMSIG(status));
  else if (!result.finished)
    result.ending = "ended with an error";
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace crumple::lab::stability
