// What `sixpoint up` looks at before it changes anything: that its ports are free, that there is room, and that the database there is
// this plant's and of a version that can be served.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

#include "cli/local_plant.h"
#include "cli/service_user.h"

namespace sixpoint::cli {

// Those of the calls and those where it is seen.
absl::Status CheckPorts(const LocalPlant& plant);
// In the folder, or where it is to be made.
absl::Status CheckRoom(const LocalPlant& plant);
// Nothing to say where no cluster is.
absl::Status CheckCluster(const LocalPlant& plant, const ServiceUser& user);
// The number that PostgreSQL gave to the cluster when it was made; its copies and backups have it too. Empty where there is none.
absl::StatusOr<std::string> DatabaseSystemOf(const LocalPlant& plant);

}  // namespace sixpoint::cli
