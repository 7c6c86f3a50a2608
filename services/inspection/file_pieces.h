// Files that a call streams, as ExportResults and the reports do.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <string>

namespace sixpoint::inspection {

// In pieces of a megabyte at most; an empty one tells of an empty file.
template <typename Response>
absl::Status WriteInPieces(const std::string& file, const std::string& content, grpc::ServerWriter<Response>* writer) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  for (std::size_t at = 0; at == 0 || at < content.size(); at += kPiece) {
    Response response;
    response.set_file(file);
    response.set_content(content.substr(at, kPiece));
    if (!writer->Write(response)) return absl::CancelledError(file + ": the client went away");
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::inspection
