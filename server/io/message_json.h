#pragma once

#include "common/error.h"

#include <google/protobuf/message.h>

#include <string>
#include <string_view>

namespace crumple::io {

// Reads protobuf JSON into `message`. Stricter than protobuf: no trailing
// commas, no field twice.
// Errors: malformed text (line and column), nesting deeper than 100, an unknown field, a field given twice, a value of
// another type, a member of a oneof beside another, an unknown enum name; the field's path and the value and rule in
// words. Of a file, its name and the line are added: see with_line().
Result<void> parse_json(std::string_view json, google::protobuf::Message& message);

// Indented, field names as in the .proto.
Result<std::string> print_json(const google::protobuf::Message& message);

// The error with "(pane.json, line 7)" at its end, the line being that of its field.
Error with_line(Error error, std::string_view json, const std::string& file_name);

}  // namespace crumple::io
