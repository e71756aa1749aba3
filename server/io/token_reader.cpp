#include "server/io/token_reader.h"

#include "common/text.h"

#include <charconv>
#include <cmath>

namespace crumple::io {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == '\v' || c == '\f'; }

// What of a faulty word goes into a message: short and printable.
std::string shown(std::string_view word) {
  std::string out;
  for (const char c : word.substr(0, 40)) out += c >= 32 && c < 127 ? c : '?';
  return word.size() > 40 ? out + "..." : out;
}

}  // namespace

void TokenReader::skip_blanks() {
  while (at_ < text_.size()) {
    const char c = text_[at_];
    if (comment_ != '\0' && c == comment_) {
      while (at_ < text_.size() && text_[at_] != '\n') ++at_;
    } else if (c == '\n') {
      ++line_;
      ++at_;
    } else if (is_blank(c)) {
      ++at_;
    } else {
      return;
    }
  }
}

void TokenReader::fail(std::string message) {
  if (failed_) return;
  failed_ = true;
  error_ = Error{ErrorCode::invalid_argument, text(name_, ":", line_), std::move(message)};
}

std::unexpected<Error> TokenReader::fault(std::string message) {
  fail(std::move(message));
  return std::unexpected(error_);
}

bool TokenReader::at_end() {
  skip_blanks();
  return at_ == text_.size();
}

std::string_view TokenReader::word_or_end() {
  if (failed_) return {};
  skip_blanks();
  const std::size_t begin = at_;
  while (at_ < text_.size() && !is_blank(text_[at_]) && text_[at_] != '\n' &&
         (comment_ == '\0' || text_[at_] != comment_))
    ++at_;
  return text_.substr(begin, at_ - begin);
}

std::string_view TokenReader::word() {
  const std::string_view out = word_or_end();
  if (out.empty()) fail("ends too early");
  return out;
}

std::string_view TokenReader::rest_of_line() {
  if (failed_) return {};
  const std::size_t begin = at_;
  while (at_ < text_.size() && text_[at_] != '\n' && (comment_ == '\0' || text_[at_] != comment_)) ++at_;
  return text_.substr(begin, at_ - begin);
}

void TokenReader::next_line() {
  while (at_ < text_.size() && text_[at_] != '\n') ++at_;
}

double TokenReader::number(const char* what) {
  std::string_view w = word();
  if (failed_) return 0;
  const std::string_view digits = w.starts_with('+') ? w.substr(1) : w;
  double value = 0;
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (problem != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(value)) {
    fail(text(what, " is '", shown(w), "', must be a finite number"));
    return 0;
  }
  return value;
}

std::int64_t TokenReader::integer(const char* what, std::int64_t low, std::int64_t high) {
  const std::string_view w = word();
  if (failed_) return 0;
  std::int64_t value = 0;
  const auto [end, problem] = std::from_chars(w.data(), w.data() + w.size(), value);
  if (problem != std::errc{} || end != w.data() + w.size()) {
    fail(text(what, " is '", shown(w), "', must be a whole number"));
    return 0;
  }
  if (value < low || value > high) {
    fail(text(what, " is ", value, ", must be in [", low, ", ", high, "]"));
    return 0;
  }
  return value;
}

}  // namespace crumple::io
