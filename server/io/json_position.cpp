#include "server/io/json_position.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <string>

namespace crumple::io {
namespace {

// Walks over well-formed JSON. Nothing here recurses: nesting is counted.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text) {}

  std::size_t at() const { return at_; }
  char next() {
    skip_blanks();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  void skip_char() { at_ = std::min(at_ + 1, text_.size()); }

  std::string_view skip_string() {
    const std::size_t begin = ++at_;
    while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    at_ = std::min(at_, text_.size());
    const std::string_view body = text_.substr(begin, at_ - begin);
    skip_char();
    return body;
  }

  void skip_value() {
    int depth = 0;
    do {
      const char c = next();
      if (c == '"')
        skip_string();
      else
        skip_char();
      if (c == '{' || c == '[') ++depth;
      if (c == '}' || c == ']') --depth;
      if (c == '\0') return;
      if (depth == 0 && c != '{' && c != '[' && c != '}' && c != ']' && c != '"') skip_scalar();
    } while (depth > 0);
  }

 private:
  void skip_blanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  void skip_scalar() {
    while (at_ < text_.size() && text_[at_] != ',' && text_[at_] != '}' && text_[at_] != ']') ++at_;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

std::string normal(std::string_view key) {
  std::string out;
  for (const char c : key)
    if (c != '_') out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// Cursor before an object: moves it before the key's value.
bool enter_key(Cursor& cursor, std::string_view key) {
  if (cursor.next() != '{') return false;
  cursor.skip_char();
  while (cursor.next() == '"') {
    const bool found = normal(cursor.skip_string()) == normal(key);
    if (cursor.next() != ':') return false;
    cursor.skip_char();
    if (found) return cursor.next() != '\0';
    cursor.skip_value();
    if (cursor.next() == ',') cursor.skip_char();
  }
  return false;
}

bool enter_index(Cursor& cursor, std::size_t index) {
  if (cursor.next() != '[') return false;
  cursor.skip_char();
  for (std::size_t i = 0; cursor.next() != ']' && cursor.next() != '\0'; ++i) {
    if (i == index) return true;
    cursor.skip_value();
    if (cursor.next() == ',') cursor.skip_char();
  }
  return false;
}

// Takes ".name", "name" or "[3]" off the front of the path.
bool enter_part(Cursor& cursor, std::string_view& path) {
  if (path.front() == '[') {
    std::size_t index = 0;
    const auto parsed = std::from_chars(path.data() + 1, path.data() + path.size(), index);
    path.remove_prefix(std::min(path.size(), static_cast<std::size_t>(parsed.ptr - path.data()) + 1));
    return enter_index(cursor, index);
  }
  if (path.front() == '.') path.remove_prefix(1);
  const std::string_view key = path.substr(0, path.find_first_of(".["));
  path.remove_prefix(key.size());
  return enter_key(cursor, key);
}

}  // namespace

int line_of(std::string_view json, std::string_view path) {
  Cursor cursor(json);
  cursor.next();
  std::size_t found = cursor.at();
  while (!path.empty() && enter_part(cursor, path)) found = cursor.at();
  return 1 + static_cast<int>(std::count(json.begin(), json.begin() + static_cast<std::ptrdiff_t>(found), '\n'));
}

}  // namespace crumple::io
