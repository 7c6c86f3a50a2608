#include "metrology/kinematics/angle_table.h"

#include <cmath>
#include <string>

#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

struct Piece {
  size_t first = 0, second = 0;
  double part = 0;  // of the way from first to second
};

Piece PieceAt(size_t count, double angle_rad) {
  const double turns = angle_rad / kTurn_rad;
  const double at = (turns - std::floor(turns)) * static_cast<double>(count);
  const auto first = static_cast<size_t>(at) % count;
  return {first, (first + 1) % count, at - std::floor(at)};
}

double Between(const std::vector<double>& values, const Piece& piece) {
  return values[piece.first] + piece.part * (values[piece.second] - values[piece.first]);
}

}  // namespace

absl::Status AngleTable::Check() const {
  constexpr size_t kFewest = 4;
  constexpr double kGreatestRad = 0.1;
  if (forward_rad.size() < kFewest || backward_rad.size() != forward_rad.size())
    return Refuse(
        "angle_table",
        std::to_string(forward_rad.size()) + " values forward and " + std::to_string(backward_rad.size()) + " backward",
        "as many both ways, at least 4");
  for (const auto* values : {&forward_rad, &backward_rad})
    for (size_t i = 0; i < values->size(); ++i)
      if (!(std::abs((*values)[i]) <= kGreatestRad))
        return Refuse("angle_table[" + std::to_string(i) + "]", Rounded((*values)[i]) + " rad", "within +-0.1");
  return absl::OkStatus();
}

double AngleTable::ErrorAt(double commanded_rad, Travel travel) const {
  const Piece piece = PieceAt(forward_rad.size(), commanded_rad);
  if (travel == Travel::kForward) return Between(forward_rad, piece);
  if (travel == Travel::kBackward) return Between(backward_rad, piece);
  return (Between(forward_rad, piece) + Between(backward_rad, piece)) / 2;
}

double AngleTable::CommandFor(double reached_rad, Travel travel) const {
  // An axis's error changes by far less than the angle does: each round shrinks what is left by the slope.
  constexpr int kMostRounds = 60;
  double command = reached_rad;
  for (int round = 0; round < kMostRounds; ++round) {
    const double next = reached_rad - ErrorAt(command, travel);
    const bool settled = std::abs(next - command) < 1e-15 * (1 + std::abs(next));
    command = next;
    if (settled) break;
  }
  return command;
}

}  // namespace sixpoint::metrology
