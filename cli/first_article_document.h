// What people know of a first article (docs/examples/first_article.yaml), as a message.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/inspection/v1/report.pb.h"

namespace sixpoint::cli {

absl::StatusOr<inspection::v1::FirstArticleFields> LoadFirstArticleFields(const std::string& path);

}  // namespace sixpoint::cli
