#pragma once

#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>

#include <string>

#include "tests/support/running_server.h"

// Calls of services whose stubs we do not have: bytes in, bytes out.
namespace crumple::test {

inline grpc::ByteBuffer bytes_of(const std::string& text) {
  const grpc::Slice slice(text);
  return {&slice, 1};
}

inline std::string text_of(const grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  if (!bytes.Valid() || !bytes.Dump(&slices).ok()) return "";
  std::string all;
  for (const grpc::Slice& slice : slices) all.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return all;
}

// Sends one message to any method, unary or not, and answers the first that comes back.
inline std::pair<grpc::Status, std::string> generic_call(const std::string& address, const std::string& method,
                                                         const std::string& request) {
  grpc::GenericStub stub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kDeadline);
  grpc::CompletionQueue queue;
  const auto next = [&] {
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
  };
  const auto call = stub.PrepareCall(&context, method, &queue);
  call->StartCall(nullptr);
  next();
  call->Write(bytes_of(request), nullptr);
  next();
  call->WritesDone(nullptr);
  next();
  grpc::ByteBuffer response;
  call->Read(&response, nullptr);
  next();
  grpc::Status status;
  call->Finish(&status, nullptr);
  next();
  return {status, text_of(response)};
}

}  // namespace crumple::test
