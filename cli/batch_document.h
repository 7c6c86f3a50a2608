// `register --batch FILE`: the file as one request.
#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json_fwd.hpp>

#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

inline constexpr std::size_t kMostBatchRequests = 1000;

// {defaults: {method, axis_tables, free, in, not_in, weights, coarse, least_stock_mm, greatest_stock_mm, patch_mm, least_points,
// least_side_part},
// registrations: [{blade, scans: [...], the same}]}: what an entry has stands for the default. One line for each thing that is
// wrong.
absl::StatusOr<registration::v1::RegisterBatchRequest> BatchFromDocument(const nlohmann::json& document);

}  // namespace sixpoint::cli
