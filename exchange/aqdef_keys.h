// The K-fields that we write, with the longest text that each takes, and what K0009 says in ours.
#pragma once

#include <cstddef>

namespace sixpoint::exchange::aqdef {

struct Key {
  int number;
  std::size_t longest;  // 0: a number or time
};

inline constexpr int kCount = 100;
// Of a part.
inline constexpr Key kPartNumber{1001, 30}, kPartTitle{1002, 80}, kPartRevision{1004, 20}, kMachine{1082, 40},
    kOperation{1086, 40}, kOperator{1222, 40};
// Of a characteristic.
inline constexpr Key kNumber{2001, 20}, kName{2002, 80}, kType{2004, 0}, kDecimals{2022, 0}, kNominal{2101, 0},
    kLower{2110, 0}, kUpper{2111, 0}, kLowerKind{2120, 0}, kUpperKind{2121, 0}, kUnit{2142, 20}, kRemark{2900, 255};
// Of a value.
inline constexpr Key kValue{1, 0}, kAttribute{2, 0}, kTime{4, 0}, kOperatorNumber{8, 0}, kText{9, 255},
    kMachineNumber{10, 0}, kSerial{14, 40}, kOrder{53, 20};

// K0009: "UNDECIDABLE; U=0.012 mm; least=-0.03 mm; greatest=0.05 mm; reason=...": what there is of it, in this order.
inline constexpr char kUncertainty[] = "; U=", kLeast[] = "; least=", kGreatest[] = "; greatest=",
                      kReason[] = "; reason=";

}  // namespace sixpoint::exchange::aqdef
