#pragma once

#include <sstream>
#include <string>

namespace crumple {

// The arguments one after another, numbers with six significant digits: text("is ", 0.5, ", must be below 0.5").
template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  (out << ... << parts);
  return std::move(out).str();
}

}  // namespace crumple
