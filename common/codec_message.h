#pragma once

#include "common/error.h"

#include <cstdint>
#include <string>
#include <string_view>

// The envelope of what the frame codec writes: a header and a content, which may be compressed. frame_codec.h has the table.
namespace crumple {

enum class Codec : std::uint8_t { quantised16 = 0, float32 = 1 };

inline constexpr std::uint32_t kMaxContentBytes = 1u << 28;

enum class MessageKind : std::uint8_t { topology = 1, frame = 2 };

inline constexpr int kCodecVersion = 2;  // written; 1 is read too

// How a message's content is written.
struct MessageForm {
  Codec codec = Codec::quantised16;
  bool compress = true;
  int version = kCodecVersion;
};

// The content must not exceed kMaxContentBytes. Always of kCodecVersion.
std::string close_message(MessageKind kind, MessageForm form, std::string content);

struct OpenMessage {
  MessageForm form;
  std::string_view content;  // of the message's bytes, or of:
  std::string unpacked;
};

// Into `message`, which must stay where it is while its content is looked at. Errors: a header that is not of the table, another
// kind, a content of another length than it says or that zstd does not take.
Result<void> open_message(std::string_view bytes, MessageKind kind, OpenMessage& message);

}  // namespace crumple
