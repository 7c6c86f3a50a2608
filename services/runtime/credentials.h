// How both ends of a connection know each other: TLS with the plant's own certificates (identity/authority.h).
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/security/server_credentials.h>

#include <filesystem>
#include <memory>
#include <string>

namespace sixpoint::runtime {

// Of a client: `folder` holds identity.pem and authority.pem. Without identity.pem it is nobody, which is enough for a health
// check. A renewed certificate counts for the next connection. INVALID_ARGUMENT naming the file that is missing or cannot be read.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> ChannelCredentialsOf(const std::filesystem::path& folder);

// Of who has nothing yet and comes for a first certificate: shows none and believes whoever answers, so that nothing may be said
// or believed by it but what is sealed.
std::shared_ptr<grpc::ChannelCredentials> CredentialsForAStranger();

// Of a service: asks whoever connects for a certificate and lets admission judge it, call by call, in plain words
// (admission.h): a handshake could only hang up.
absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> ServerCredentialsOf(const std::filesystem::path& folder);

// Of a service, at its start: that its key, its certificate and the authority beside them belong together, and are this service's. What
// clients would else see is a handshake that fails.
absl::Status CheckServiceCredentials(const std::filesystem::path& folder, const std::string& area);

}  // namespace sixpoint::runtime
