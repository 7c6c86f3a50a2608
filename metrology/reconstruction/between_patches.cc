// Where a blank's machined surface stands between its patches. A design of waves that are as narrow as a patch, moved along itself by the blank, lies
// lower between two patches than at either; what is known of it is how the patches about it were carried.
#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/parallel/loops.h"
#include "metrology/reconstruction/deformed_surface.h"
#include "metrology/reconstruction/shape_problem.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kAboutPatches = 1.5;  // so many patches' widths about a guess the patches are asked
constexpr std::size_t kLeastAbout = 3;
constexpr double kEvenPart = 0.25;  // of a patch's width: nearer ones weigh no more

}  // namespace

void ShapeProblem::EvenFixed() {
  PlaceGrid about(kAboutPatches * options_.patch_mm);
  std::vector<std::size_t> patch_of;
  for (std::size_t j = 0; j < measured_count_; ++j) {
    if (!look_.feet[j] || !Is(j, RegionKind::kFixed)) continue;
    about.Add(look_.feet[j]->place_mm, look_.feet[j]->design_normal);
    patch_of.push_back(j);
  }
  std::vector<BlankPatch> even(patch_of.size());
  ForEachChunk(even.size(), kChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurfaceFoot& foot = *look_.feet[patch_of[i]];
      double count = 0, rest_mm = 0, variance_mm2 = 0;
      about.EachNear(foot.place_mm, foot.design_normal, kSameWallCosine, [&](std::size_t k, const Vector3d&, double) {
        const double uncertainty_mm = blank_[patch_of[k]].standard_uncertainty_mm;
        count += 1;
        rest_mm += look_.feet[patch_of[k]]->distance_mm;
        variance_mm2 += uncertainty_mm * uncertainty_mm;
      });
      even[i] = blank_[patch_of[i]];
      even[i].point_mm += (rest_mm / count - foot.distance_mm) * foot.normal;
      even[i].standard_uncertainty_mm = std::sqrt(variance_mm2) / count;
    }
  });
  for (std::size_t i = 0; i < even.size(); ++i) {
    SurfaceFoot& foot = *look_.feet[patch_of[i]];
    // Along the normal: the foot stays where it is.
    foot.distance_mm += foot.normal.dot(even[i].point_mm - blank_[patch_of[i]].point_mm);
    blank_[patch_of[i]] = even[i];
  }
}

void ShapeProblem::GuessBetween(const FreeFormDeformation& blank_as) {
  PlaceGrid about(kAboutPatches * options_.patch_mm);
  std::vector<std::size_t> patch_of;
  for (std::size_t j = 0; j < measured_count_; ++j) {
    if (!look_.feet[j] || look_.region_of_patch[j] == regions_.size()) continue;
    about.Add(look_.feet[j]->place_mm, look_.feet[j]->design_normal);
    patch_of.push_back(j);
  }
  const auto guess = [&](const SurfacePoint& on) -> std::optional<Guess> {
    const auto local = blank_as.LocalAt(on.point_mm);
    if (!local) return std::nullopt;
    double weights = 0, rest_mm = 0, uncertainty_mm = 0;
    std::size_t count = 0;
    about.EachNear(on.point_mm, on.normal, kSameWallCosine, [&](std::size_t k, const Vector3d&, double distance_mm) {
      const double even_mm = kEvenPart * options_.patch_mm;
      const double weight = 1 / (distance_mm * distance_mm + even_mm * even_mm);
      weights += weight;
      rest_mm += weight * look_.feet[patch_of[k]]->distance_mm;
      uncertainty_mm = std::max(uncertainty_mm, blank_[patch_of[k]].standard_uncertainty_mm);
      ++count;
    });
    if (count < kLeastAbout) return std::nullopt;
    const Vector3d normal = DeformedNormal(local->Jacobian(), on.normal);
    Guess made{{on.point_mm + local->displacement_mm + rest_mm / weights * normal, normal, uncertainty_mm},
               {},
               -std::numeric_limits<double>::infinity()};
    made.near.place_mm = on.point_mm;
    made.near.design_normal = on.normal;
    made.near.triangle = on.triangle;
    return made;
  };
  std::vector<std::array<std::optional<Guess>, 4>> guesses(design_.places.size());
  ForEachChunk(guesses.size(), kChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (regions_[region_of_[i]].kind != RegionKind::kMachined) continue;
      const DesignPlace& place = design_.places[i];
      const Vector3d one = place.normal.unitOrthogonal(), other = place.normal.cross(one);
      for (std::size_t k = 0; k < 4; ++k) {
        const Vector3d aside = (k < 2 ? 1.0 : -1.0) * one + (k % 2 == 0 ? 1.0 : -1.0) * other;
        const SurfacePoint on =
            design_.surface->Closest(place.point_mm + design_.spacing_mm / 4 * aside, place.triangle);
        if (on.feature == SurfaceFeature::kFace && IsSameWall(on.normal, place.normal)) guesses[i][k] = guess(on);
      }
    }
  });
  between_.clear();
  for (const auto& four : guesses)
    for (const auto& one : four)
      if (one) between_.push_back(*one);
}

std::size_t ShapeProblem::TakeLacking(const FreeFormDeformation& deformation) {
  std::vector<std::optional<SurfaceFoot>> feet(between_.size());
  std::vector<double> spares_mm(between_.size(), 0);
  double most_wanted_mm = 0;
  for (const ShapeRegion& region : regions_)
    if (region.kind == RegionKind::kMachined) most_wanted_mm = std::max(most_wanted_mm, region.allowance_mm);
  ForEachChunk(feet.size(), kChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Guess& guess = between_[i];
      const BlankPatch& patch = guess.patch;
      const auto local = deformation.LocalAt(guess.near.place_mm);
      if (!local) continue;
      // What had stock has it still where the shape has hardly moved.
      if (guess.spare_mm - kGoesAlong * (local->displacement_mm - guess.near.displacement_mm).norm() >
          kPlentyOfStock_mm)
        continue;
      guess.near.displacement_mm = local->displacement_mm;
      // Nor is looked for the foot of what has plenty, wherever that is.
      const Vector3d normal = DeformedNormal(local->Jacobian(), guess.near.design_normal);
      const Vector3d from_mm = patch.point_mm - guess.near.place_mm - local->displacement_mm;
      const double out_mm = normal.dot(from_mm);
      guess.spare_mm = out_mm - kGoesAlong * (from_mm - out_mm * normal).norm() - most_wanted_mm -
                       options_.coverage_factor * patch.standard_uncertainty_mm;
      if (guess.spare_mm > kPlentyOfStock_mm) continue;
      feet[i] =
          FootOf(*design_.surface, &deformation, patch.point_mm, patch.normal, options_.greatest_stock_mm, &guess.near);
      if (!feet[i]) continue;
      const std::size_t region = RegionAt(regions_, feet[i]->place_mm, feet[i]->design_normal);
      if (region == regions_.size() || regions_[region].kind != RegionKind::kMachined) {
        feet[i].reset();
        continue;
      }
      guess.spare_mm = spares_mm[i] =
          feet[i]->distance_mm - WantedAt(*feet[i], regions_[region], patch.standard_uncertainty_mm).wanted_mm;
    }
  });
  // One that lacks takes along those that hardly do not, lest they lack next.
  if (spares_mm.empty() || *std::min_element(spares_mm.begin(), spares_mm.end()) >= -options_.threshold_mm) return 0;
  std::vector<Guess> left;
  const std::size_t before = blank_.size();
  for (std::size_t i = 0; i < between_.size(); ++i) {
    if (!feet[i] || spares_mm[i] >= options_.margin_mm / 2) {
      left.push_back(between_[i]);
      continue;
    }
    blank_.push_back(between_[i].patch);
    first_feet_.push_back(feet[i]);
  }
  between_ = std::move(left);
  Resize();
  ForEachChunk(blank_.size() - before, kChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t j = before + begin; j < before + end; ++j) LookAtPatch(j, &deformation, &*first_feet_[j]);
  });
  return blank_.size() - before;
}

void ShapeProblem::DropGuesses() {
  blank_.resize(measured_count_);
  Resize();
}

void ShapeProblem::Resize() {
  const std::size_t count = blank_.size();
  first_feet_.resize(count);
  about_machined_.resize(count, false);
  look_.feet.resize(count);
  look_.patch_bands.resize(count);
  look_.wanted_mm.resize(count, 0);
  look_.cut_part.resize(count, 1);
  look_.region_of_patch.resize(count, regions_.size());
}

}  // namespace sixpoint::metrology
