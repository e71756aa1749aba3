#include "server/io/message_json.h"

#include "server/io/json_position.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>
#include <vector>

namespace crumple::io {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

// Well-formed or not, where, and no key twice. Numbers and strings pass by.
class SyntaxCheck final : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::string fault;

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }
  bool start_object(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool key(string_t& name) override {
    if (keys_.back().insert(name).second) return true;
    fault = "gives the field \"" + name + "\" twice";
    return false;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& e) override {
    // "[json.exception.parse_error.101] parse error at line 3, column 5: ..." without its number
    const std::string what = e.what();
    const std::size_t end = what.find("] ");
    fault = "is not JSON: " + (end == std::string::npos ? what : what.substr(end + 2));
    return false;
  }

 private:
  static constexpr std::size_t kMaxDepth = 100;

  bool enter() {
    keys_.emplace_back();
    if (keys_.size() <= kMaxDepth) return true;
    fault = "is nested deeper than 100 levels";
    return false;
  }
  bool leave() {
    keys_.pop_back();
    return true;
  }

  std::vector<std::set<std::string>> keys_;  // of the objects around; empty sets for lists
};

// The field of a path such as bodies[2].rigid.kind, null if there is none; turns its names into those of the .proto.
const FieldDescriptor* find_field(const Descriptor* type, std::string& path) {
  const FieldDescriptor* field = nullptr;
  for (std::size_t at = 0; at < path.size() && type;) {
    const std::size_t end = std::min(path.find_first_of(".[", at), path.size());
    const std::string name = path.substr(at, end - at);
    field = type->FindFieldByName(name);
    if (!field) field = type->FindFieldByCamelcaseName(name);
    if (!field) return nullptr;
    path.replace(at, end - at, field->name());
    type = field->message_type();
    const std::size_t dot = path.find('.', at);
    at = dot == std::string::npos ? path.size() : dot + 1;
  }
  return field;
}

std::string enum_names(const FieldDescriptor& field) {
  std::string names;
  const auto* type = field.enum_type();
  for (int i = 0; i < type->value_count(); ++i) names += (i ? ", " : "") + type->value(i)->name();
  return names;
}

std::string expected(const FieldDescriptor* field) {
  if (!field) return "a value of the field's type";
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
    case FieldDescriptor::CPPTYPE_INT64:
      return "an integer";
    case FieldDescriptor::CPPTYPE_UINT32:
    case FieldDescriptor::CPPTYPE_UINT64:
      return "an integer that is not negative";
    case FieldDescriptor::CPPTYPE_FLOAT:
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return "a number";
    case FieldDescriptor::CPPTYPE_BOOL:
      return "true or false";
    case FieldDescriptor::CPPTYPE_STRING:
      return "a string";
    case FieldDescriptor::CPPTYPE_ENUM:
      return "one of " + enum_names(*field);
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return field->is_repeated() ? "a list of objects {...}" : "an object {...}";
  }
  return "a value of the field's type";
}

// protobuf says "(bodies[0].rigid) densty: Cannot find field.",
//               "(bodies[0].rigid.density): invalid value "abc" for type TYPE_DOUBLE" and
//               "(bodies[0]): invalid value oneof field 'model' is already set. Cannot set 'fem' for type oneof".
Error in_our_words(const std::string& said, const Descriptor* type) {
  Error error{ErrorCode::invalid_argument, "", said};
  const std::size_t close = said.find(')');
  std::string rest = said;
  if (said.starts_with("(") && close != std::string::npos) {
    error.field = said.substr(1, close - 1);
    rest = said.substr(close + 1);
  }
  if (const std::size_t unknown = rest.find(": Cannot find field"); unknown != std::string::npos) {
    const std::size_t begin = rest.find_first_not_of(' ');
    const std::string name = rest.substr(begin, unknown - begin);
    error.field += (error.field.empty() ? "" : ".") + name;
    error.message = "is not a field of the format";
    return error;
  }
  const std::size_t value = rest.find("invalid value "), of = rest.rfind(" for type ");
  if (value == std::string::npos || of == std::string::npos) return error;
  const std::string given = rest.substr(value + 14, of - value - 14);
  if (given.starts_with("oneof field '")) {
    const std::size_t open = given.find("Cannot set '"), end = given.rfind('\'');
    error.field += (error.field.empty() ? "" : ".") + given.substr(open + 12, end - open - 12);
    const std::string group = given.substr(13, given.find('\'', 13) - 13);
    find_field(type, error.field);
    error.message =
        group.starts_with("_") ? "is given twice" : "is given beside another " + group + ", must be given alone";
    return error;
  }
  const FieldDescriptor* field = find_field(type, error.field);
  error.message = "is " + given + ", must be " + expected(field);
  return error;
}

}  // namespace

Result<void> parse_json(std::string_view json, google::protobuf::Message& message) {
  SyntaxCheck syntax;
  if (!nlohmann::json::sax_parse(json.begin(), json.end(), &syntax)) return invalid("", syntax.fault);
  const auto status = google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &message);
  if (status.ok()) return {};
  return std::unexpected(in_our_words(std::string(status.message()), message.GetDescriptor()));
}

Result<std::string> print_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(message, &json, options);
  if (status.ok()) return json;
  return std::unexpected(Error{ErrorCode::internal, "", "cannot be written as JSON: " + std::string(status.message())});
}

Error with_line(Error error, std::string_view json, const std::string& file_name) {
  error.message += " (" + file_name;
  if (!error.field.empty()) error.message += ", line " + std::to_string(line_of(json, error.field));
  error.message += ")";
  return error;
}

}  // namespace crumple::io
