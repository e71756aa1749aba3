#pragma once

#include <string_view>

namespace crumple::io {

// Line, from 1, at which the value of a field path starts in well-formed JSON, such as line 7 of
// `bodies[2].fem.material.poisson_ratio`. Where the text has no such value: the line of the innermost part of the path
// that it has. Keys match in either of protobuf's spellings, poisson_ratio and poissonRatio.
int line_of(std::string_view json, std::string_view path);

}  // namespace crumple::io
