#include "metrology/nearest/near_cells.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "metrology/nearest/candidate_lister.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

// A cell's key: which block along each axis, and which place in it.
constexpr int kBlockBits = 19, kPlaceBits = 2;       // of each coordinate
constexpr std::uint64_t kNoKey = ~std::uint64_t{0};  // of no cell
constexpr double kGreatestCellsAcross = (1 << (kBlockBits + kPlaceBits)) - 2;
// Cells of about the mean triangle's edge hold some tens of candidates.
constexpr double kEdgesPerCell = 1.6;
// Slivers have no area, but a length: of all triangles together no more cells than this along each.
constexpr double kCellsAlong = 6;
constexpr double kLeastCellMm = 0.02;
constexpr std::size_t kTouchedAtATime = std::size_t{1} << 18;  // cells touched more than once
constexpr std::size_t kListedAtATime = std::size_t{1} << 13;
// Units of lists that a piece has room for, more than most take: what is not written takes no memory, and a piece of 6 MB is given back as one
// (services/registration/fit_memory.h), where one that grew step by step would leave its steps in the heap.
constexpr std::size_t kRoomOfCell = 96;

std::uint64_t KeyOf(const Eigen::Array3i& cell) {
  constexpr int kPlace = (1 << kPlaceBits) - 1;
  std::uint64_t key = 0;
  for (int k = 0; k < 3; ++k) key = key << kBlockBits | static_cast<std::uint64_t>(cell[k] >> kPlaceBits);
  for (int k = 0; k < 3; ++k) key = key << kPlaceBits | static_cast<std::uint64_t>(cell[k] & kPlace);
  return key;
}
std::uint64_t BlockOf(std::uint64_t key) { return key >> 3 * kPlaceBits; }
std::uint64_t BitOf(std::uint64_t key) { return std::uint64_t{1} << (key & ((1 << 3 * kPlaceBits) - 1)); }

// As std::popcount, which is a library call on the processors that we build for.
std::uint32_t CountBits(std::uint64_t bits) {
  bits -= bits >> 1 & 0x5555555555555555ULL;
  bits = (bits & 0x3333333333333333ULL) + (bits >> 2 & 0x3333333333333333ULL);
  bits = (bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0fULL;
  return static_cast<std::uint32_t>(bits * 0x0101010101010101ULL >> 56);
}

// The given bits of each number in turn, the last first.
Eigen::Vector3d Unpacked(std::uint64_t packed, int bits) {
  Eigen::Vector3d numbers;
  for (int k = 2; k >= 0; --k, packed >>= bits)
    numbers[k] = static_cast<double>(packed & ((std::uint64_t{1} << bits) - 1));
  return numbers;
}

void SortUnique(std::vector<std::uint64_t>* keys) {
  std::sort(keys->begin(), keys->end());
  keys->erase(std::unique(keys->begin(), keys->end()), keys->end());
}

}  // namespace

struct NearCells::Listed {
  std::vector<std::uint64_t> keys;
  CandidateLists lists;
};

NearCells::NearCells(const TriangleTree& tree, double covered_mm, int thread_count)
    : tree_(tree), covered_mm_(covered_mm) {
  FindShapes();
  ListEach(CellsNearSurface(thread_count), thread_count);
}

void NearCells::FindShapes() {
  const std::vector<IndexedTriangle>& items = tree_.items();
  Eigen::AlignedBox3d bounds_mm;
  double area = 0, lengths_mm = 0;
  shapes_.reserve(items.size());
  for (const IndexedTriangle& item : items) {
    const Eigen::Vector3d &a = tree_.corner(item, 0), &b = tree_.corner(item, 1), &c = tree_.corner(item, 2);
    area += 0.5 * (b - a).cross(c - a).norm();
    lengths_mm += std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
    bounds_mm.extend(a).extend(b).extend(c);
    shapes_.push_back(ShapeOf(b - a, c - a));
  }
  const double edge_mm = std::sqrt(4 / std::sqrt(3.0) * area / static_cast<double>(items.size()));
  const double extent_mm = bounds_mm.sizes().maxCoeff() + 4 * covered_mm_;
  const double mean_length_mm = lengths_mm / static_cast<double>(items.size());
  cell_mm_ = std::max(
      {kEdgesPerCell * edge_mm, mean_length_mm / kCellsAlong, kLeastCellMm, extent_mm / kGreatestCellsAcross * 1.01});
  per_cell_ = 1 / cell_mm_;
  low_mm_ = bounds_mm.min() - Eigen::Vector3d::Constant(covered_mm_ + 2 * cell_mm_);
}

double NearCells::radius_mm() const { return 0.5 * std::sqrt(3.0) * cell_mm_; }

// Cells with their centre in the band about the surface, sorted.
std::vector<std::uint64_t> NearCells::CellsNearSurface(int thread_count) const {
  const std::vector<IndexedTriangle>& items = tree_.items();
  std::vector<std::vector<std::uint64_t>> touched_of(PartCount(thread_count));
  InParts(items.size(), thread_count, [&](std::size_t begin, std::size_t end, std::size_t part) {
    std::vector<std::uint64_t>& touched_here = touched_of[part];
    std::size_t most = kTouchedAtATime;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3d &a = tree_.corner(items[i], 0), &b = tree_.corner(items[i], 1),
                            &c = tree_.corner(items[i], 2);
      const Eigen::Array3d from = (a.cwiseMin(b).cwiseMin(c) - low_mm_).array() - covered_mm_;
      const Eigen::Array3d to = (a.cwiseMax(b).cwiseMax(c) - low_mm_).array() + covered_mm_;
      Touch(items[i], (from / cell_mm_).floor().cast<int>(), (to / cell_mm_).floor().cast<int>(), &touched_here);
      if (touched_here.size() < most) continue;
      SortUnique(&touched_here);
      most = std::max(most, 2 * touched_here.size());
    }
    SortUnique(&touched_here);
  });
  std::vector<std::uint64_t> touched = std::move(touched_of[0]);
  for (std::size_t part = 1; part < touched_of.size(); ++part)
    touched.insert(touched.end(), touched_of[part].begin(), touched_of[part].end());
  SortUnique(&touched);
  return touched;
}

// No candidate is farther from its cell's centre than a centre of the band from the surface and the cell's diagonal.
CandidateLists NearCells::NoLists() const {
  return CandidateLists(static_cast<float>(covered_mm_ + 3.01 * radius_mm()));
}

// Those of the keys that have candidates, with them.
NearCells::Listed NearCells::List(const std::uint64_t* keys, std::size_t count) const {
  constexpr double kAcross = 4;  // cells that are listed together: they share most of their candidates
  const double band_mm = covered_mm_ + radius_mm();  // of the centre of a cell that holds a covered point
  Listed listed{{}, NoLists()};
  listed.keys.reserve(count);
  listed.lists.Reserve(count, kRoomOfCell * count);
  CandidateLister lister(tree_, shapes_);
  std::array<Eigen::Vector3d, CandidateLister::kMostCells> centres_mm;
  for (std::size_t from = 0, together; from < count; from += together) {
    Eigen::AlignedBox3d box;
    for (together = 0; together < std::min(centres_mm.size(), count - from); ++together) {
      centres_mm[together] = CentreOf(keys[from + together]);
      box.extend(centres_mm[together]);
      if (together > 0 && box.sizes().maxCoeff() > kAcross * cell_mm_) break;
    }
    const std::uint32_t have_one = lister.List(centres_mm.data(), together, radius_mm(), band_mm, &listed.lists);
    for (std::size_t i = 0; i < together; ++i)
      if (have_one >> i & 1) listed.keys.push_back(keys[from + i]);
  }
  return listed;
}

void NearCells::ListEach(const std::vector<std::uint64_t>& touched, int thread_count) {
  std::vector<std::optional<Listed>> parts = OfEachChunk<std::optional<Listed>>(
      touched.size(), kListedAtATime, thread_count,
      [&](std::size_t begin, std::size_t end) { return List(&touched[begin], end - begin); });
  std::size_t cell_count = 0, unit_count = 0;
  for (const std::optional<Listed>& part : parts) {
    cell_count += part->keys.size();
    unit_count += part->lists.unit_count();
  }
  std::vector<std::uint64_t> keys;
  keys.reserve(cell_count);
  lists_.emplace(NoLists());
  lists_->Reserve(cell_count, unit_count);
  for (std::optional<Listed>& part : parts) {
    keys.insert(keys.end(), part->keys.begin(), part->keys.end());
    lists_->Append(part->lists);
    part.reset();
  }
  MakeTable(keys);
}

void NearCells::MakeTable(const std::vector<std::uint64_t>& keys) {
  std::size_t block_count = 0;
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (i == 0 || BlockOf(keys[i]) != BlockOf(keys[i - 1])) ++block_count;
  int slot_bits = 4;
  while (std::size_t{1} << slot_bits < 2 * block_count) ++slot_bits;
  blocks_.assign(std::size_t{1} << slot_bits, {});
  slot_shift_ = 64 - slot_bits;
  centres_mm_.reserve(keys.size());
  Block* block = nullptr;
  for (std::uint32_t cell = 0; cell < keys.size(); ++cell) {
    const std::uint64_t key = BlockOf(keys[cell]) + 1;
    if (block == nullptr || block->key != key) {
      std::size_t slot = SlotOf(key - 1);
      while (blocks_[slot].key != 0) slot = (slot + 1) & (blocks_.size() - 1);
      block = &blocks_[slot];
      *block = {key, 0, cell};
    }
    block->cells |= BitOf(keys[cell]);
    centres_mm_.push_back(CentreOf(keys[cell]));
  }
}

Eigen::Vector3d NearCells::CentreOf(std::uint64_t key) const {
  const Eigen::Vector3d cell = (1 << kPlaceBits) * Unpacked(BlockOf(key), kBlockBits) + Unpacked(key, kPlaceBits);
  return low_mm_ + cell_mm_ * (cell.array() + 0.5).matrix();
}

// By halves: what a long triangle's box holds is more than memory does.
void NearCells::Touch(const IndexedTriangle& item, const Eigen::Array3i& first, const Eigen::Array3i& last,
                      std::vector<std::uint64_t>* touched) const {
  const Eigen::Array3i across = last - first + 1;
  const Eigen::Vector3d centre = low_mm_ + 0.5 * cell_mm_ * (first + last + 1).cast<double>().matrix();
  const double reach_mm = (0.5 * cell_mm_ * across.cast<double>().matrix().norm() + covered_mm_) * (1 + 1e-12);
  NearestTriangle nearest;
  TakeNearer(tree_.vertices(), item, centre, &nearest);
  if (nearest.distance_squared > reach_mm * reach_mm) return;
  int axis;
  if (across.maxCoeff(&axis) == 1) {
    touched->push_back(KeyOf(first));
    return;
  }
  Eigen::Array3i middle = last, next = first;
  middle[axis] = first[axis] + across[axis] / 2 - 1;
  next[axis] = middle[axis] + 1;
  Touch(item, first, middle, touched);
  Touch(item, next, last, touched);
}

void NearCells::CellsAt(const Eigen::Vector3d* points_mm, std::size_t count, std::uint32_t* cells) const {
  // The table's lines are on their way before they are read.
  std::array<std::uint64_t, kTogether> keys;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Array3d at = ((points_mm[i] - low_mm_) * per_cell_).array();
    const bool inside = (at >= 0).all() && (at < kGreatestCellsAcross).all();
    keys[i] = inside ? KeyOf(at.cast<int>()) : kNoKey;
    __builtin_prefetch(&blocks_[SlotOf(BlockOf(keys[i]))]);
  }
  // A scan's neighbours often share a cell, and where it sees two walls the one before the last does.
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0 && keys[i] == keys[i - 1])
      cells[i] = cells[i - 1];
    else if (i > 1 && keys[i] == keys[i - 2])
      cells[i] = cells[i - 2];
    else
      cells[i] = Find(keys[i]);
  }
}

std::uint32_t NearCells::Find(std::uint64_t key) const {
  const std::size_t last = blocks_.size() - 1;
  const std::uint64_t block_key = BlockOf(key), bit = BitOf(key);
  for (std::size_t slot = SlotOf(block_key); blocks_[slot].key != 0; slot = (slot + 1) & last) {
    const Block& block = blocks_[slot];
    if (block.key != block_key + 1) continue;
    if ((block.cells & bit) == 0) return kNoCell;
    return block.first_cell + CountBits(block.cells & (bit - 1));
  }
  return kNoCell;
}

std::size_t NearCells::memory_bytes() const {
  return shapes_.capacity() * sizeof(TriangleShape) + blocks_.capacity() * sizeof(Block) + lists_->memory_bytes() +
         centres_mm_.capacity() * sizeof(Eigen::Vector3d);
}

Candidates NearCells::CandidatesOf(std::uint32_t cell) const {
  return {centres_mm_[cell], cell_width_mm(), (*lists_)[cell]};
}

}  // namespace sixpoint::metrology
