#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

// Plain numbers <-> little-endian bytes.
namespace crumple {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

class ByteWriter {
 public:
  template <class T>
  void put(T number) {
    static_assert(std::is_arithmetic_v<T>);
    append(&number, sizeof number);
  }
  void append(const void* data, std::size_t size) {
    if (size > 0) bytes_.append(static_cast<const char*>(data), size);  // an empty array's data may be null
  }
  void pad_to_4() { bytes_.append((4 - bytes_.size() % 4) % 4, '\0'); }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Never reads past the end: what is missing reads as zero and ok() turns false for good.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T get() {
    static_assert(std::is_arithmetic_v<T>);
    T number{};
    if (const char* data = skip(sizeof number)) std::memcpy(&number, data, sizeof number);
    return number;
  }
  // Start of the next `size` bytes, which are then behind; null if so many are not there.
  const char* skip(std::uint64_t size) {
    if (!ok_ || size > bytes_.size() - at_) {
      ok_ = false;
      return nullptr;
    }
    const char* data = bytes_.data() + at_;
    at_ += size;
    return data;
  }
  // Zeros up to the next multiple of 4.
  void skip_padding() {
    while (ok_ && at_ % 4 != 0)
      if (get<std::uint8_t>() != 0) ok_ = false;
  }

  bool ok() const { return ok_; }
  bool at_end() const { return ok_ && at_ == bytes_.size(); }
  std::size_t remaining() const { return ok_ ? bytes_.size() - at_ : 0; }
  std::size_t position() const { return at_; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace crumple
