#include "server/lab/chart/pinning.h"

#include "common/text.h"
#include "server/lab/chart/commit.h"

#include <sched.h>

#include <cstring>
#include <fstream>

namespace crumple::lab::chart {
namespace {

static_assert(sizeof(cpu_set_t) == sizeof(unsigned long) * 16);

cpu_set_t allowed() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) != 0 || CPU_COUNT(&set) == 0) CPU_SET(0, &set);
  return set;
}

}  // namespace

int allowed_processors() {
  const cpu_set_t set = allowed();
  return CPU_COUNT(&set);
}

Pinning::Pinning(int count) {
  const cpu_set_t set = allowed();
  std::memcpy(before_, &set, sizeof set);
  cpu_set_t chosen;
  CPU_ZERO(&chosen);
  for (int cpu = CPU_SETSIZE - 1; cpu >= 0 && count > 0; --cpu) {
    if (!CPU_ISSET(cpu, &set)) continue;
    CPU_SET(cpu, &chosen);
    --count;
  }
  held_ = sched_setaffinity(0, sizeof chosen, &chosen) == 0;
}

Pinning::~Pinning() {
  cpu_set_t set;
  std::memcpy(&set, before_, sizeof set);
  if (held_) sched_setaffinity(0, sizeof set, &set);
}

std::string machine_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("model name")) continue;
    const auto colon = line.find(": ");
    if (colon != std::string::npos) return text(line.substr(colon + 2), ", ", allowed_processors(), " processors");
  }
  return text("unknown processor, ", allowed_processors(), " allowed");
}

std::string compiler_name() {
#if defined(__clang__)
  const std::string name = text("clang ", __clang_major__, ".", __clang_minor__, ".", __clang_patchlevel__);
#else
  const std::string name = text("g++ ", __GNUC__, ".", __GNUC_MINOR__, ".", __GNUC_PATCHLEVEL__);
#endif
#ifdef NDEBUG
  return name + " release";
#else
  return name + " debug";
#endif
}

std::string commit() { return kCommit; }

}  // namespace crumple::lab::chart
