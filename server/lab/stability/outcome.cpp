#include "server/lab/stability/outcome.h"

#include <array>
#include <utility>

namespace crumple::lab::stability {

namespace {
constexpr std::array<const char*, 4> kNames{"pass", "limit", "fails", "not built"};
}

const char* name_of(Verdict verdict) { return kNames[static_cast<int>(verdict)]; }

bool parse(const std::string& name, Verdict& verdict) {
  for (int k = 0; k < 4; ++k) {
    if (name != kNames[k]) continue;
    verdict = static_cast<Verdict>(k);
    return true;
  }
  return false;
}

bool is_worse(Verdict a, Verdict b) {
  return a != Verdict::not_built && b != Verdict::not_built && static_cast<int>(a) > static_cast<int>(b);
}

Outcome judged(bool sound, bool holds, double value, std::string text) {
  return {!sound ? Verdict::fails : holds ? Verdict::pass : Verdict::limit, value, std::move(text)};
}

Outcome missing(std::string what) { return {Verdict::not_built, 0, std::move(what)}; }

}  // namespace crumple::lab::stability
