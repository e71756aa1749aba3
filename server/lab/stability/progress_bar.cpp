#include "server/lab/stability/progress_bar.h"

#include "common/text.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>

namespace crumple::lab::stability {

namespace {
constexpr int kWidth = 30;
constexpr double kLineEvery = 30;  // [s]

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
}  // namespace

ProgressBar::ProgressBar(double total)
    : terminal_(isatty(STDERR_FILENO)), total_(std::max(total, 1e-9)), start_(now()), last_line_(start_) {}

std::string ProgressBar::time_left() const {
  if (done_ < 0.01 * total_) return "?";
  const long seconds = std::lround((now() - start_) * (total_ - done_) / done_);
  return text(seconds / 60, " min ", seconds % 60, " s");
}

void ProgressBar::show(const std::string& what) {
  const int percent = static_cast<int>(100 * std::min(1.0, done_ / total_));
  if (terminal_) {
    const int filled = percent * kWidth / 100;
    std::cerr << "\r[" << std::string(filled, '#') << std::string(kWidth - filled, '.') << "] " << percent << " %, "
              << time_left() << " left: " << what << "\033[K" << std::flush;
  } else if (now() - last_line_ > kLineEvery) {
    std::cerr << "stability: " << percent << " %, " << time_left() << " left: " << what << "\n";
    last_line_ = now();
  }
}

void ProgressBar::advance(double work) { done_ += work; }

void ProgressBar::finish() {
  if (terminal_) std::cerr << "\r\033[K" << std::flush;
}

}  // namespace crumple::lab::stability
