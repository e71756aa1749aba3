#pragma once

#include "server/io/gltf_document.h"

namespace crumple::io {

// The bytes of each of a document's buffers: of the file's own binary part, of a data URI, or of a file beside it.
// binary: that part; empty: none. folder: the file's own. Errors: a buffer that is missing, outside of the folder, too
// short, or no base64.
Result<std::vector<std::string>> gltf_buffers(const GltfDocument& document, std::string_view binary,
                                              const std::filesystem::path& folder);

}  // namespace crumple::io
