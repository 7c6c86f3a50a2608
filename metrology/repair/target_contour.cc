#include "metrology/repair/target_contour.h"

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/linear_algebra/inverse.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr int kEndPoints = 60;

// Where the envelope of all circles touches one of them, to the left of the line and to its right: outward normals.
struct Contacts {
  Vector2d along, left, right;
};

// By a parabola through three neighbours, over the way along the centres.
std::vector<Contacts> ContactsOf(const std::vector<TargetCircle>& circles) {
  std::vector<double> at_mm(circles.size(), 0);
  for (std::size_t i = 1; i < circles.size(); ++i)
    at_mm[i] = at_mm[i - 1] + (circles[i].centre_mm - circles[i - 1].centre_mm).norm();
  std::vector<Contacts> contacts;
  for (std::size_t i = 0; i < circles.size(); ++i) {
    const std::size_t m = std::clamp<std::size_t>(i, 1, circles.size() - 2);
    const double a = at_mm[m] - at_mm[m - 1], b = at_mm[m + 1] - at_mm[m], x = at_mm[i] - at_mm[m];
    const auto slope = [&](const auto& before, const auto& middle, const auto& after) {
      const auto one = (middle - before) / a, other = (after - middle) / b;
      return ((b * one + a * other) / (a + b) + 2 * x * (other - one) / (a + b));
    };
    const Vector2d along =
        slope(circles[m - 1].centre_mm, circles[m].centre_mm, circles[m + 1].centre_mm).eval().normalized();
    const double opens =
        std::clamp(slope(circles[m - 1].radius_mm, circles[m].radius_mm, circles[m + 1].radius_mm), -0.95, 0.95);
    const double sideways = std::sqrt(1 - opens * opens);
    contacts.push_back({along, -opens * along + sideways * LeftOf(along), -opens * along - sideways * LeftOf(along)});
  }
  return contacts;
}

// Nodes and their uncertainties, as they are made.
struct Maker {
  std::vector<OutlineNode> nodes;
  std::vector<double> standard_mm;

  void Add(const Vector2d& point_mm, const Vector2d& normal, double sigma_mm) {
    OutlineNode node;
    node.point_mm = point_mm;
    node.normal = normal;
    nodes.push_back(node);
    standard_mm.push_back(sigma_mm);
  }
  void AddContact(const TargetCircle& circle, const Vector2d& along, const Vector2d& normal) {
    const double across = LeftOf(along).dot(normal) * circle.across_sigma_mm;
    Add(circle.centre_mm + circle.radius_mm * normal, normal, std::hypot(across, circle.radius_sigma_mm));
  }
  TargetSection Made(double z_mm) { return {z_mm, Outline(std::move(nodes)), std::move(standard_mm)}; }
};

std::vector<TargetCircle> NominalCircles(const CamberProfile& profile) {
  std::vector<TargetCircle> circles;
  for (const CamberStation& station : profile.stations) circles.push_back({station.centre_mm, station.radius_mm, 0, 0});
  return circles;
}

// One contact of an end's circle with the outline: where it is nominally, and how far the target lies outward of it.
struct EndContact {
  Vector2d nominal_mm, normal;
  double outward_mm = 0, sigma_mm = 0;
  double ahead_mm = 0;  // and counter-clockwise of it
};

EndContact Between(const TargetCircle& nominal, const TargetCircle& target, const Vector2d& nominal_normal,
                   const Vector2d& target_normal, const Vector2d& along) {
  EndContact contact;
  contact.nominal_mm = nominal.centre_mm + nominal.radius_mm * nominal_normal;
  contact.normal = nominal_normal;
  const Vector2d off_mm = target.centre_mm + target.radius_mm * target_normal - contact.nominal_mm;
  contact.outward_mm = nominal_normal.dot(off_mm);
  contact.ahead_mm = LeftOf(nominal_normal).dot(off_mm);
  contact.sigma_mm = std::hypot(LeftOf(along).dot(nominal_normal) * target.across_sigma_mm, target.radius_sigma_mm);
  return contact;
}

// The nominal end from one contact to the other, counter-clockwise: each place moved by one vector and grown along its normal, so that both
// contacts and the tip lie where they are to lie.
void AddEnd(const Outline& nominal, const EndContact& first, const EndContact& second, const CamberExtension& tip,
            const TargetEnd& end, Maker* maker) {
  Eigen::MatrixXd rows(3, 3);
  rows << first.normal.transpose(), 1, second.normal.transpose(), 1, tip.outward.transpose(), 1;
  // A tip between normals that are its own would not tell growth from motion.
  const Eigen::MatrixXd inverse = Inverse(rows);
  const Eigen::Vector3d outward(first.outward_mm, second.outward_mm, end.outward_mm);
  const Eigen::Vector3d sigma(first.sigma_mm, second.sigma_mm, end.sigma_mm);
  const Eigen::Vector3d moved = inverse * outward;
  // From where the first circle touches to where the second does: the end slides along the contacts, and would overlap them.
  const auto slid = [&](const EndContact& contact) {
    return nominal.At(nominal.Nearest(contact.nominal_mm)) + contact.ahead_mm -
           LeftOf(contact.normal).dot(moved.head<2>());
  };
  const double from_mm = slid(first);
  double to_mm = slid(second);
  if (to_mm < from_mm) to_mm += nominal.length_mm();
  for (int k = 1; k < kEndPoints; ++k) {
    const OutlinePlace place = nominal.PlaceAt(from_mm + (to_mm - from_mm) * k / kEndPoints);
    const Vector2d normal = nominal.NormalAt(place);
    const Eigen::RowVector3d by = Eigen::RowVector3d(normal.x(), normal.y(), 1) * inverse;
    maker->Add(nominal.PointAt(place) + moved.head<2>() + moved[2] * normal, normal,
               by.transpose().cwiseProduct(sigma).norm());
  }
}

void AddArc(const TargetCircle& circle, const Vector2d& first, const Vector2d& second, const Vector2d& outward,
            double tip_sigma_mm, Maker* maker) {
  const double from = std::atan2(first.y(), first.x());
  double turn = std::atan2(second.y(), second.x()) - from;
  if (turn < 0) turn += 2 * kPi;
  for (int k = 1; k < kEndPoints; ++k) {
    const double angle = from + turn * k / kEndPoints;
    const Vector2d normal(std::cos(angle), std::sin(angle));
    const double along = normal.dot(outward), across = std::sqrt(std::max(0.0, 1 - along * along));
    maker->Add(circle.centre_mm + circle.radius_mm * normal, normal,
               std::hypot(along * tip_sigma_mm, across * circle.across_sigma_mm));
  }
}

}  // namespace

TargetSection EnvelopeWithEnds(const std::vector<TargetCircle>& circles, const BladeSection& nominal,
                               const TargetEnd& leading, const TargetEnd& trailing) {
  const std::vector<TargetCircle> drawn = NominalCircles(nominal.profile);
  const std::vector<Contacts> contacts = ContactsOf(circles), drawn_contacts = ContactsOf(drawn);
  const std::size_t last = circles.size() - 1;
  const auto between = [&](std::size_t i, bool left) {
    return Between(drawn[i], circles[i], left ? drawn_contacts[i].left : drawn_contacts[i].right,
                   left ? contacts[i].left : contacts[i].right, contacts[i].along);
  };
  // Counter-clockwise: along the right side, about the trailing end, back along the left one, about the leading end.
  Maker maker;
  for (std::size_t i = 0; i <= last; ++i) maker.AddContact(circles[i], contacts[i].along, contacts[i].right);
  AddEnd(nominal.outline, between(last, false), between(last, true), nominal.profile.trailing, trailing, &maker);
  for (std::size_t i = last + 1; i-- > 0;) maker.AddContact(circles[i], contacts[i].along, contacts[i].left);
  AddEnd(nominal.outline, between(0, true), between(0, false), nominal.profile.leading, leading, &maker);
  return maker.Made(nominal.z_mm);
}

TargetSection MovedWhole(const TargetSection& section, const PlaneMotion& motion, const PlaneMotion& sigma,
                         const Vector2d& pivot_mm) {
  const Eigen::Isometry2d moved = motion.About(pivot_mm);
  std::vector<OutlineNode> nodes = section.outline.nodes();
  std::vector<double> standard_mm = section.standard_mm;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].point_mm = moved * nodes[i].point_mm;
    nodes[i].normal = moved.linear() * nodes[i].normal;
    const double by_turn = nodes[i].normal.dot(LeftOf(nodes[i].point_mm - pivot_mm)) * sigma.turn_rad;
    const double by_shift = nodes[i].normal.cwiseProduct(sigma.shift_mm).norm();
    standard_mm[i] = std::hypot(standard_mm[i], by_turn, by_shift);
  }
  return {section.z_mm, Outline(std::move(nodes)), std::move(standard_mm)};
}

TargetSection EnvelopeWithArcs(const std::vector<TargetCircle>& circles, double z_mm, double leading_sigma_mm,
                               double trailing_sigma_mm) {
  const std::vector<Contacts> contacts = ContactsOf(circles);
  const std::size_t last = circles.size() - 1;
  Maker maker;
  for (std::size_t i = 0; i <= last; ++i) maker.AddContact(circles[i], contacts[i].along, contacts[i].right);
  AddArc(circles[last], contacts[last].right, contacts[last].left, contacts[last].along, trailing_sigma_mm, &maker);
  for (std::size_t i = last + 1; i-- > 0;) maker.AddContact(circles[i], contacts[i].along, contacts[i].left);
  AddArc(circles[0], contacts[0].left, contacts[0].right, -contacts[0].along, leading_sigma_mm, &maker);
  return maker.Made(z_mm);
}

}  // namespace sixpoint::metrology
