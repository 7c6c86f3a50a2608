// An order in which to visit places so that the ways between them are short. Pure; the same costs give the same order.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace sixpoint::metrology {

// cost(i, j): of the way from i to j; it may differ from that back. Each place once, from any to any. Up to 12 places the best of all orders; of more the
// best that is found from the nearest neighbours of each start by turning round and moving pieces of the order.
std::vector<int> ShortOrder(const Eigen::MatrixXd& cost);

// The sum of its ways.
double TravelOf(const std::vector<int>& order, const Eigen::MatrixXd& cost);

}  // namespace sixpoint::metrology
