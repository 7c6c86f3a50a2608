// Cholesky factors of a symmetric positive definite matrix whose unknowns stand in layers, each of which is coupled with the next few
// alone, as the controls of a lattice are. Blocks are dense: for a solid lattice this is quicker than factors of scattered elements.
//
// The order of every sum is fixed: the same matrix gives the same bits.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace sixpoint::metrology {

class LayeredCholesky {
 public:
  // sizes: unknowns of each layer, in their order. reach: how many following layers a layer is coupled with. All elements 0.
  LayeredCholesky(const std::vector<Eigen::Index>& sizes, Eigen::Index reach);

  Eigen::Index size() const { return size_; }
  // Adds to the element at row >= column; both within reach.
  void Add(Eigen::Index row, Eigen::Index column, double value) {
    const auto layer = static_cast<std::size_t>(layer_of_[static_cast<std::size_t>(column)]);
    blocks_[layer](row - first_[layer], column - first_[layer]) += value;
  }
  // Of the matrix, before it is factored; row >= column.
  double At(Eigen::Index row, Eigen::Index column) const {
    const auto layer = static_cast<std::size_t>(layer_of_[static_cast<std::size_t>(column)]);
    return blocks_[layer](row - first_[layer], column - first_[layer]);
  }

  // In place: L with L L^T the matrix. False where it is not positive definite; then nothing below may be called.
  bool Factor();
  // L^-1 right and L^-T right, column by column, in place. Each column's zeros at its beginning are skipped together.
  void SolveForward(Eigen::MatrixXd* right) const;
  void SolveBackward(Eigen::MatrixXd* right) const;
  void Solve(Eigen::MatrixXd* right) const {
    SolveForward(right);
    SolveBackward(right);
  }

 private:
  Eigen::Index size_ = 0, reach_ = 0;
  std::vector<Eigen::Index> first_;      // unknown of each layer, and the end
  std::vector<Eigen::Index> layer_of_;   // of each unknown
  std::vector<Eigen::MatrixXd> blocks_;  // of each layer: its columns, from its first row to the last that it reaches
};

}  // namespace sixpoint::metrology
