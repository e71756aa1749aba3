#pragma once

#include <string>

namespace crumple::lab::stability {

// What a check found for one method.
//   pass       the criterion holds
//   limit      finite, bounded and reported, but the criterion is missed; `value` says by how much
//   fails      not finite, unbounded, crashed, or the failure that the row is about stays for ever
//   not_built  the method, or what the row needs of it, does not exist yet
enum class Verdict { pass, limit, fails, not_built };

struct Outcome {
  Verdict verdict = Verdict::not_built;
  double value = 0;  // the figure that the criterion bounds; larger is worse. NaN: there is none
  std::string text;  // what was measured, with units
};

const char* name_of(Verdict verdict);  // "pass", "limit", "fails", "not built"
bool parse(const std::string& name, Verdict& verdict);
bool is_worse(Verdict a, Verdict b);  // not_built is neither better nor worse than anything

// fails unless `sound`; then pass where `holds`, else limit.
Outcome judged(bool sound, bool holds, double value, std::string text);
Outcome missing(std::string what);

}  // namespace crumple::lab::stability
