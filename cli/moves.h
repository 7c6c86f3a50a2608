// How far blades moved between two registrations.
#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

// Greatest displacement of the box round the part between two poses, um: no point of the part moved farther.
absl::StatusOr<double> GreatestMove_um(const registration::v1::Registration& before,
                                       const registration::v1::Registration& after,
                                       const geometry::v1::Point& minimum_mm, const geometry::v1::Point& maximum_mm);

// Those of a batch, by the parts' boxes.
class Moves {
 public:
  // before: by the batch's index, or none; must outlive this.
  Moves(Session* session, const std::vector<registration::v1::Registration>& before)
      : session_(session), before_(before) {}

  bool empty() const { return before_.empty(); }
  const registration::v1::Registration& before(int index) const { return before_[static_cast<std::size_t>(index)]; }
  // Nothing where one of the two has no pose. The plant is asked once for each part.
  absl::StatusOr<std::optional<double>> Greatest_um(int index, const registration::v1::Registration& after);

 private:
  Session* const session_;
  const std::vector<registration::v1::Registration>& before_;
  std::map<std::string, plant::v1::Part> parts_;
};

}  // namespace sixpoint::cli
