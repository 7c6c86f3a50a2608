// `register` with its progress: one blade, or many by `--batch FILE`, `--blades A,B,...`, `--part P --since T`.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/timestamp.pb.h>

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/session.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

// {defaults: {method, axis_tables, free, in, out, weights, coarse, least_stock_mm, greatest_stock_mm, patch_mm, least_points},
// registrations: [{blade, scans: [...], the same}]}: what an entry has stands for the default. One line for each thing that is
// wrong.
absl::StatusOr<registration::v1::RegisterBatchRequest> BatchFromDocument(const nlohmann::json& document);

// Blades that were registered before, again from the same scans.
struct Again {
  registration::v1::RegisterBatchRequest request;
  std::vector<registration::v1::Registration> before;  // by the request's index
};

// Each blade's latest registration again, by its method, with axis tables where that had them. A method other than
// METHOD_UNSPECIFIED, or axis_tables, stands for all.
absl::StatusOr<Again> BatchOfLatest(Session* session, const std::vector<std::string>& blades,
                                    registration::v1::Method method, bool axis_tables);

// Of which registrations the latest of each blade is taken.
struct AgainFilter {
  std::string part;     // its name
  std::string machine;  // its name; empty: any
  google::protobuf::Timestamp since, until;
};
absl::StatusOr<Again> BatchOfPart(Session* session, const AgainFilter& filter, registration::v1::Method method,
                                  bool axis_tables);

// "2026-11-21", "2026-11-21 03:25:01Z" or RFC 3339; UTC where it names no zone. INVALID_ARGUMENT names the option.
absl::StatusOr<google::protobuf::Timestamp> TimeOf(const std::string& option, const std::string& text);

// Greatest displacement of the box round the part between two poses, um: no point of the part moved farther.
absl::StatusOr<double> GreatestMove_um(const registration::v1::Registration& before,
                                       const registration::v1::Registration& after,
                                       const geometry::v1::Point& minimum_mm, const geometry::v1::Point& maximum_mm);

// In as many calls as it takes, each of the session's deadline at most; a call that broke off is made again and goes on.
// Prints each result: as lines of JSON when it is there, or a table at the end; and what each moved from `before`, if that was
// given. The request has a request_id.
absl::Status RegisterBatch(Session* session, registration::v1::RegisterBatchRequest request,
                           const std::vector<registration::v1::Registration>& before = {});

// One alone, with a line on stderr that tells how far it is. Refusals are as Register's. The request has a request_id.
absl::StatusOr<registration::v1::Registration> RegisterWatched(Session* session,
                                                               registration::v1::RegisterRequest request);

}  // namespace sixpoint::cli
