// The few XML answers of S3 that we read: an error's code, a page of a list. Private to storage.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "storage/object_store.h"

namespace sixpoint::storage {

// "NoSuchKey"; empty where the text is no error of S3.
std::string S3ErrorCodeOf(const std::string& xml);
// INTERNAL where the text is no such page: a list that was misread would delete what is in use.
absl::StatusOr<ObjectStore::ListPage> ReadS3List(const std::string& xml);

}  // namespace sixpoint::storage
