#include "services/correction/lattice_bytes.h"

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "services/runtime/little_endian.h"

namespace sixpoint::correction {
namespace {

// What they are, and in which form.
constexpr char kBegin[] = "sixpoint lattice 1\n";
constexpr std::size_t kBeginBytes = sizeof kBegin - 1, kHeadBytes = kBeginBytes + 6 * 8 + 3 * 4;
constexpr std::uint32_t kMostCells = 1'000'000;  // along an axis; what all may be FreeFormDeformation says

}  // namespace

std::string LatticeBytes(const metrology::FreeFormDeformation& deformation) {
  const metrology::ControlLattice& lattice = deformation.lattice();
  std::string bytes(kBegin, kBeginBytes);
  for (int axis = 0; axis < 3; ++axis) runtime::Append<std::uint64_t>(lattice.corner_mm[axis], &bytes);
  for (int axis = 0; axis < 3; ++axis) runtime::Append<std::uint64_t>(lattice.spacing_mm[axis], &bytes);
  for (const int cells : lattice.cells) runtime::Append<std::uint32_t>(cells, &bytes);
  for (std::size_t cell = 0; cell < lattice.cell_count(); ++cell)
    bytes.push_back(deformation.covered().empty() || deformation.covered()[cell] != 0 ? '\1' : '\0');
  const metrology::ControlDisplacements& controls_mm = deformation.controls_mm();
  for (Eigen::Index i = 0; i < controls_mm.size(); ++i) runtime::Append<std::uint64_t>(controls_mm.data()[i], &bytes);
  return bytes;
}

absl::StatusOr<metrology::FreeFormDeformation> DeformationOf(const std::string& bytes) {
  const auto lost = [](const std::string& what) { return absl::DataLossError("lattice: " + what); };
  if (bytes.size() < kHeadBytes || bytes.compare(0, kBeginBytes, kBegin) != 0)
    return lost("does not begin as one of this form does");
  std::size_t at = kBeginBytes;
  metrology::ControlLattice lattice;
  for (int axis = 0; axis < 3; ++axis) lattice.corner_mm[axis] = runtime::Take<std::uint64_t, double>(bytes, &at);
  for (int axis = 0; axis < 3; ++axis) lattice.spacing_mm[axis] = runtime::Take<std::uint64_t, double>(bytes, &at);
  for (int& cells : lattice.cells) {
    const auto count = runtime::Take<std::uint32_t, std::uint32_t>(bytes, &at);
    if (count == 0 || count > kMostCells) return lost("cells out of range");
    cells = static_cast<int>(count);
  }
  // Looked at before anything is made of them: 1e18 would not overflow.
  const double cells = static_cast<double>(lattice.cells[0]) * lattice.cells[1] * lattice.cells[2];
  const double controls = static_cast<double>(lattice.Controls(0)) * lattice.Controls(1) * lattice.Controls(2);
  if (static_cast<double>(bytes.size()) != static_cast<double>(kHeadBytes) + cells + 24 * controls)
    return lost("not as long as its cells say");
  std::vector<std::uint8_t> covered(lattice.cell_count());
  for (std::uint8_t& cell : covered) cell = static_cast<std::uint8_t>(bytes[at++]);
  metrology::ControlDisplacements controls_mm(3, static_cast<Eigen::Index>(lattice.control_count()));
  for (Eigen::Index i = 0; i < controls_mm.size(); ++i)
    controls_mm.data()[i] = runtime::Take<std::uint64_t, double>(bytes, &at);
  auto made = metrology::FreeFormDeformation::Make(lattice, std::move(controls_mm), std::move(covered));
  if (!made.ok()) return lost(std::string(made.status().message()));
  return made;
}

}  // namespace sixpoint::correction
