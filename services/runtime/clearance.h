// Whether a request names what its caller may not see: the method's rule says by which fields (sixpoint/access/v1), the database of
// which part each name is, and who is cleared for it (storage/clearances.h).
#pragma once

#include <absl/status/status.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <memory>
#include <string>

#include "storage/clearances.h"

namespace sixpoint::runtime {

// Thread-safe.
class Clearance {
 public:
  explicit Clearance(std::shared_ptr<const storage::ClearanceReader> clearances) : clearances_(std::move(clearances)) {}

  // PERMISSION_DENIED (CLEARANCE_MISSING) where one of the names is of a part that is hidden from the reader or, where any is, is not
  // recorded: that something is there is not told. A rule that says nothing of parts: of none that anything is hidden from.
  absl::Status Check(const google::protobuf::MethodDescriptor& method, const storage::Reader& reader,
                     const google::protobuf::Message& request, storage::Deadline deadline) const;

 private:
  const std::shared_ptr<const storage::ClearanceReader> clearances_;
};

// The same of one name, for a handler that asks itself.
absl::Status CheckSeen(const storage::ClearanceReader& clearances, const storage::Reader& reader,
                       const std::string& field, const std::string& name, storage::Unrecorded unrecorded,
                       storage::Deadline deadline);

}  // namespace sixpoint::runtime
