// An order in which to visit places so that the ways between them are short. Pure; the same costs give the same order.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace sixpoint::metrology {

// cost(i, j): of the way from i to j; it may differ from that back. Each place once, from any to any. Up to 12 places the best of all orders; of more the
// best that is found from the nearest neighbours of some starts by turning round and moving pieces of the order; the more places, the fewer starts. Where
// keep_going (may be empty) says no, what is found by then.
std::vector<int> ShortOrder(const Eigen::MatrixXd& cost, const std::function<bool()>& keep_going = nullptr);

// The sum of its ways.
double TravelOf(const std::vector<int>& order, const Eigen::MatrixXd& cost);

}  // namespace sixpoint::metrology
