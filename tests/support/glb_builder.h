#pragma once

#include <nlohmann/json.hpp>

#include <cstring>
#include <string>
#include <vector>

namespace crumple::test {

// The bytes of a .glb, put together by hand.
struct GlbBuilder {
  nlohmann::json document{{"asset", {{"version", "2.0"}}},
                          {"accessors", nlohmann::json::array()},
                          {"bufferViews", nlohmann::json::array()}};
  std::string binary;

  // An accessor of its own view; its id.
  template <class T>
  int add(const std::vector<T>& numbers, const std::string& type, int component_type, bool normalised = false) {
    const int items = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
    const int view = add_view(numbers);
    document["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component_type}, {"count", numbers.size() / items}, {"type", type}});
    if (normalised) document["accessors"].back()["normalized"] = true;
    return static_cast<int>(document["accessors"].size()) - 1;
  }
  int floats(const std::vector<float>& numbers, const std::string& type) { return add(numbers, type, 5126); }
  template <class T>
  int add_view(const std::vector<T>& numbers) {
    document["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", numbers.size() * sizeof(T)}});
    binary.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T));
    binary.resize((binary.size() + 3) / 4 * 4);
    return static_cast<int>(document["bufferViews"].size()) - 1;
  }

  std::string bytes() const {
    nlohmann::json whole = document;
    whole["buffers"] = {{{"byteLength", binary.size()}}};
    std::string json = whole.dump();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const auto number = [](std::size_t value) {
      const auto small = static_cast<std::uint32_t>(value);
      std::string out(4, 0);
      std::memcpy(out.data(), &small, 4);
      return out;
    };
    return "glTF" + number(2) + number(28 + json.size() + binary.size()) + number(json.size()) + "JSON" + json +
           number(binary.size()) + std::string("BIN\0", 4) + binary;
  }
};

}  // namespace crumple::test
