#include "metrology/linear_algebra/layered_cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace sixpoint::metrology {

using Eigen::Index;
using Eigen::MatrixXd;

LayeredCholesky::LayeredCholesky(const std::vector<Index>& sizes, Index reach) : reach_(reach) {
  first_.push_back(0);
  for (std::size_t layer = 0; layer < sizes.size(); ++layer) {
    layer_of_.insert(layer_of_.end(), static_cast<std::size_t>(sizes[layer]), static_cast<Index>(layer));
    first_.push_back(first_.back() + sizes[layer]);
  }
  size_ = first_.back();
  for (std::size_t layer = 0; layer < sizes.size(); ++layer) {
    const std::size_t last = std::min(sizes.size(), layer + static_cast<std::size_t>(reach) + 1);
    blocks_.emplace_back(MatrixXd::Zero(first_[last] - first_[layer], sizes[layer]));
  }
}

bool LayeredCholesky::Factor() {
  for (std::size_t layer = 0; layer < blocks_.size(); ++layer) {
    MatrixXd& block = blocks_[layer];
    const Index width = block.cols(), below = block.rows() - width;
    if (width == 0) continue;
    Eigen::Ref<MatrixXd> diagonal = block.topRows(width);
    Eigen::LLT<Eigen::Ref<MatrixXd>> factor(diagonal);
    if (factor.info() != Eigen::Success) return false;
    block.topRows(width).triangularView<Eigen::StrictlyUpper>().setZero();
    if (below == 0) continue;
    block.topRows(width).triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(
        block.bottomRows(below));
    // What is below pushes on each of the layers that it stands in.
    for (std::size_t next = layer + 1; next < blocks_.size() && first_[next] < first_[layer] + block.rows(); ++next) {
      const Index from = first_[next] - first_[layer], size = first_[next + 1] - first_[next];
      blocks_[next].topRows(block.rows() - from).noalias() -=
          block.bottomRows(block.rows() - from) * block.middleRows(from, size).transpose();
    }
  }
  return true;
}

void LayeredCholesky::SolveForward(MatrixXd* right) const {
  std::size_t begin = 0;
  while (begin < blocks_.size() && right->middleRows(first_[begin], first_[begin + 1] - first_[begin]).isZero(0))
    ++begin;
  for (std::size_t layer = begin; layer < blocks_.size(); ++layer) {
    const MatrixXd& block = blocks_[layer];
    const Index width = block.cols(), below = block.rows() - width;
    if (width == 0) continue;
    block.topRows(width).triangularView<Eigen::Lower>().solveInPlace(right->middleRows(first_[layer], width));
    if (below > 0)
      right->middleRows(first_[layer] + width, below).noalias() -=
          block.bottomRows(below) * right->middleRows(first_[layer], width);
  }
}

void LayeredCholesky::SolveBackward(MatrixXd* right) const {
  for (std::size_t layer = blocks_.size(); layer-- > 0;) {
    const MatrixXd& block = blocks_[layer];
    const Index width = block.cols(), below = block.rows() - width;
    if (width == 0) continue;
    if (below > 0)
      right->middleRows(first_[layer], width).noalias() -=
          block.bottomRows(below).transpose() * right->middleRows(first_[layer] + width, below);
    block.topRows(width).triangularView<Eigen::Lower>().transpose().solveInPlace(
        right->middleRows(first_[layer], width));
  }
}

}  // namespace sixpoint::metrology
