// What a plant runs and reads of a release: its programs, its migrations, its page.
#pragma once

#include <absl/status/status.h>

#include <filesystem>

#include "cli/local_plant.h"
#include "cli/service_user.h"

namespace sixpoint::cli {

// What root reads and runs is where the service user cannot put anything else. Where they really are is in `plant` afterwards.
absl::Status CheckPrograms(LocalPlant* plant, const ServiceUser& user);

// A checkout under /root cannot be entered by the service user: then they are copied beside the data, migrations and what runs them first,
// and `plant` names the copies.
bool ServiceUserReaches(const LocalPlant& plant);
absl::Status CopyMigrations(LocalPlant* plant);
absl::Status CopyPrograms(LocalPlant* plant);

// Whether one of its programs, or its page, was written after that file.
bool AreProgramsNewer(const LocalPlant& plant, const std::filesystem::path& than);

}  // namespace sixpoint::cli
