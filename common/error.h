#pragma once

#include <expected>
#include <string>
#include <utility>

namespace crumple {

// Codes are gRPC's, so that one function at the edge turns an Error into a status.
enum class ErrorCode { invalid_argument = 3, not_found = 5, already_exists = 6, resource_exhausted = 8, failed_precondition = 9, internal = 13, unavailable = 14 };

// Bad input: a sentence that names the field, its value and the rule it breaks,
// e.g. {"bodies[2].fem.material.poisson_ratio", "is 0.5, must be below 0.5"}.
struct Error {
  ErrorCode code = ErrorCode::invalid_argument;
  std::string field;    // path of the offending field; may be empty
  std::string message;  // value and rule

  // "field message", one line.
  std::string text() const { return field.empty() ? message : field + " " + message; }
};

template <class T>
using Result = std::expected<T, Error>;

inline std::unexpected<Error> invalid(std::string field, std::string message) {
  return std::unexpected(Error{ErrorCode::invalid_argument, std::move(field), std::move(message)});
}

}  // namespace crumple
