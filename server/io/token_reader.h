#pragma once

#include "common/error.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace crumple::io {

// Words and numbers of a text file, separated by blanks and commas, with the line each stands in. Comments run from
// `comment` to the end of the line ('\0': there are none). The first fault is kept; after it every read gives nothing
// and numbers come out as 0, so that a caller reads a whole record and asks once.
class TokenReader {
 public:
  TokenReader(std::string name, std::string_view text, char comment)
      : name_(std::move(name)), text_(text), comment_(comment) {}

  std::string_view word();          // the next word; a fault at the end of the file
  std::string_view word_or_end();   // the same; empty at the end of the file
  std::string_view rest_of_line();  // what is left of the line, without comment; may be empty
  void next_line();                 // skips what is left of the line

  double number(const char* what);  // finite
  std::int64_t integer(const char* what, std::int64_t low, std::int64_t high);

  bool ok() const { return !failed_; }
  bool at_end();
  std::size_t bytes_left() const { return text_.size() - at_; }
  // Error of the fault, or one of the caller's own at the current line: {"car.node:12", message}.
  Error error() const { return error_; }
  std::unexpected<Error> fault(std::string message);

 private:
  void skip_blanks();
  void fail(std::string message);

  std::string name_;
  std::string_view text_;
  char comment_;
  std::size_t at_ = 0;
  int line_ = 1;
  bool failed_ = false;
  Error error_;
};

}  // namespace crumple::io
