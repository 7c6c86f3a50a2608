// The keeping of the store between its messages and its rows; what a request must be.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

#include "services/runtime/stored_enum.h"
#include "sixpoint/ingest/v1/store.pb.h"
#include "storage/retention_store.h"

namespace sixpoint::ingest {

// words: whose they are; they tell of one that this release does not know.
void ToProto(const storage::BlobDamage& damage, runtime::StoredWords* words, v1::BlobDamage* out);
// DATA_LOSS: a word that this release does not know.
absl::StatusOr<v1::RetentionPolicy> ToProto(const storage::RetentionPolicy& policy);
absl::StatusOr<v1::ScanDeletion> ToProto(const storage::ScanDeletion& deletion);
absl::StatusOr<v1::StoreStatus> ToProto(const storage::BlobStatus& status);
v1::Month ToProto(const storage::MonthUse& month);

// Each refusal names the field, its value and what was wanted.
absl::Status CheckRequest(const v1::CheckStoreRequest& request);
absl::Status CheckRequest(const v1::CollectGarbageRequest& request);
absl::Status CheckRequest(const v1::DeleteScanPointsRequest& request);
absl::Status CheckRequest(const v1::SetRetentionPolicyRequest& request);
absl::StatusOr<storage::PolicyPage> PageOf(const v1::ListRetentionPoliciesRequest& request);
// Of the page that follows that policy.
std::string PageTokenAfter(const std::string& filters, const storage::RetentionPolicy& last);

}  // namespace sixpoint::ingest
