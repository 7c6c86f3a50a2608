// The certificates of a plant on this machine: its own authority, what that gave each service, and what it gave the user who runs
// the plant.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "cli/local_plant.h"
#include "cli/service_user.h"
#include "identity/authority.h"

namespace sixpoint::cli {

// The folders, and the authority where there is none; what it says to everybody is told anew.
absl::Status MakeAuthority(const LocalPlant& plant, const ServiceUser& user);

enum class Renewal { kWhereDue, kAll };
struct Renewed {
  identity::IssuedCertificate certificate;
  bool is_new = false;
};
// Of each that serves (LocalPlant::Served) and of the local user, in this order. Due is what is missing, has less than a third of its time left, names other
// hosts or roles than are wanted now, was revoked, is of another authority or of another key than lies beside it. Services that run take it by themselves.
absl::StatusOr<std::vector<Renewed>> RenewCertificates(const LocalPlant& plant, const ServiceUser& user, Renewal which);

// As they lie in the services' folders, by plant.Served(); revoked_at where the authority is this user's to read.
std::vector<std::optional<identity::IssuedCertificate>> ServiceCertificates(const LocalPlant& plant,
                                                                            const ServiceUser& user);

// By which clients reach a service: this machine's own names, where it listens, and what clients are told.
std::vector<std::string> ServiceHosts(const ListenAddress& address);

// NOT_FOUND, saying how one is made, where there is none.
absl::StatusOr<identity::Authority> OpenAuthority(const std::filesystem::path& folder);

// Revokes these, and tells the services that run from `data`, where that is the authority's own plant; says whether it is.
absl::StatusOr<bool> RevokeCertificates(const std::filesystem::path& authority, const std::vector<std::string>& serials,
                                        const std::filesystem::path& data);

// Of this machine: what an authority that is made here is called.
std::string HostName();

}  // namespace sixpoint::cli
