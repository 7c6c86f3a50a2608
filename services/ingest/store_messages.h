// The keeping of the store between its messages and its rows; what a request must be.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/ingest/v1/store.pb.h"
#include "storage/retention_store.h"

namespace sixpoint::ingest {

v1::BlobHolder HolderOf(const std::string& store);
v1::BlobDamage ToProto(const storage::BlobDamage& damage);
v1::RetentionPolicy ToProto(const storage::RetentionPolicy& policy);
v1::ScanDeletion ToProto(const storage::ScanDeletion& deletion);
v1::StoreStatus ToProto(const storage::BlobStatus& status);
v1::Month ToProto(const storage::MonthUse& month);

// Each refusal names the field, its value and what was wanted.
absl::Status CheckRequest(const v1::CheckStoreRequest& request);
absl::Status CheckRequest(const v1::CollectGarbageRequest& request);
absl::Status CheckRequest(const v1::DeleteScanPointsRequest& request);
absl::Status CheckRequest(const v1::SetRetentionPolicyRequest& request);
absl::StatusOr<storage::PolicyPage> PageOf(const v1::ListRetentionPoliciesRequest& request);
// Of the page that follows that policy.
std::string PageTokenAfter(const std::string& filters, const v1::RetentionPolicy& last);

}  // namespace sixpoint::ingest
