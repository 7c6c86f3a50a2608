#include "metrology/nearest/pair_lanes.h"

#include "metrology/parallel/vectors.h"

namespace sixpoint::metrology {
namespace {

constexpr double NumberOf(TrianglePart part) { return static_cast<double>(part); }

// Where that is not below 0.
template <typename Doubles>
SIXPOINT_INLINE void Choose(const Doubles& least, const Doubles& chosen, Doubles* number) {
  *number = least >= Doubles{} ? chosen : *number;
}

template <typename Doubles>
SIXPOINT_INLINE Doubles Lesser(const Doubles& one, const Doubles& other) {
  return one < other ? one : other;
}

// Ericson, Real-Time Collision Detection, 5.1.5, all cases at once: the last that holds is chosen first. What must all be at least 0
// is so where the least of it is: one comparison makes a mask in every width, several joined do not.
template <typename Width>
SIXPOINT_INLINE void Measure(std::size_t count, PairLanes* lanes) {
  using Doubles = typename Width::Doubles;
  for (std::size_t i = 0; i < count; i += Width::kDoubles) {
    Doubles a[3], ab[3], ac[3], ap[3];
    Load(lanes->corner_0, i, a);
    Load(lanes->corner_1, i, ab);
    Load(lanes->corner_2, i, ac);
    Load(lanes->query, i, ap);
    for (int k = 0; k < 3; ++k) {
      ab[k] = ab[k] - a[k];
      ac[k] = ac[k] - a[k];
      ap[k] = ap[k] - a[k];
    }
    const Doubles abab = Product(ab, ab), abac = Product(ab, ac), acac = Product(ac, ac);
    const Doubles d1 = Product(ab, ap), d2 = Product(ac, ap);
    const Doubles zero{}, one = zero + 1.;
    const Doubles d3 = d1 - abab, d4 = d2 - abac, d5 = d1 - abac, d6 = d2 - acac;
    const Doubles va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    const Doubles scale = one / (va + vb + vc);
    Doubles v = vb * scale, w = vc * scale, part = zero + NumberOf(TrianglePart::kInside);
    const Doubles along_0 = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    const Doubles on_edge_0 = Lesser(Lesser(-va, d4 - d3), d5 - d6);
    Choose(on_edge_0, one - along_0, &v);
    Choose(on_edge_0, along_0, &w);
    Choose(on_edge_0, zero + NumberOf(TrianglePart::kEdge0), &part);
    const Doubles on_edge_1 = Lesser(Lesser(-vb, d2), -d6);
    Choose(on_edge_1, zero, &v);
    Choose(on_edge_1, d2 / acac, &w);
    Choose(on_edge_1, zero + NumberOf(TrianglePart::kEdge1), &part);
    const Doubles on_edge_2 = Lesser(Lesser(-vc, d1), -d3);
    Choose(on_edge_2, d1 / abab, &v);
    Choose(on_edge_2, zero, &w);
    Choose(on_edge_2, zero + NumberOf(TrianglePart::kEdge2), &part);
    const Doubles at_corner_2 = Lesser(d6, d6 - d5);
    Choose(at_corner_2, zero, &v);
    Choose(at_corner_2, one, &w);
    Choose(at_corner_2, zero + NumberOf(TrianglePart::kCorner2), &part);
    const Doubles at_corner_1 = Lesser(d3, d3 - d4);
    Choose(at_corner_1, one, &v);
    Choose(at_corner_1, zero + NumberOf(TrianglePart::kCorner1), &part);
    const Doubles at_corner_0 = Lesser(-d1, -d2);
    Choose(at_corner_0, zero, &v);
    Choose(at_corner_1 > at_corner_0 ? at_corner_1 : at_corner_0, zero, &w);
    Choose(at_corner_0, zero + NumberOf(TrianglePart::kCorner0), &part);
    Doubles off[3];
    for (int k = 0; k < 3; ++k) off[k] = ap[k] - v * ab[k] - w * ac[k];
    Store(v, i, lanes->v);
    Store(w, i, lanes->w);
    Store(part, i, lanes->part);
    Store(Product(off, off), i, lanes->distance_squared);
  }
}

void MeasureFour(std::size_t count, PairLanes* lanes) { Measure<Four>(count, lanes); }
SIXPOINT_EIGHT void MeasureEight(std::size_t count, PairLanes* lanes) { Measure<Eight>(count, lanes); }
SIXPOINT_SIXTEEN void MeasureSixteen(std::size_t count, PairLanes* lanes) { Measure<Sixteen>(count, lanes); }

}  // namespace

void PairLanes::Set(std::size_t lane, const Eigen::Vector3d& point, const Points& vertices,
                    const IndexedTriangle& item) {
  const Eigen::Vector3d &a = vertices[item.corners[0]], &b = vertices[item.corners[1]], &c = vertices[item.corners[2]];
  for (int k = 0; k < 3; ++k) {
    query[k].at[lane] = point[k];
    corner_0[k].at[lane] = a[k];
    corner_1[k].at[lane] = b[k];
    corner_2[k].at[lane] = c[k];
  }
}

NearestTriangle PairLanes::Found(std::size_t lane, const IndexedTriangle& item) const {
  const double its_v = v.at[lane], its_w = w.at[lane];
  return {item.triangle,
          distance_squared.at[lane],
          {1 - its_v - its_w, its_v, its_w},
          static_cast<TrianglePart>(part.at[lane]),
          &item};
}

MeasurePairs MeasurePairsOf(LaneWidth width) { return OfWidth(width, MeasureFour, MeasureEight, MeasureSixteen); }

}  // namespace sixpoint::metrology
