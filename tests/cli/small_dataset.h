// A plant of two scans, as its dataset.json would say it.
#pragma once

#include <nlohmann/json.hpp>

namespace sixpoint::cli {

inline nlohmann::json SmallDataset() {
  return nlohmann::json::parse(R"({
    "note": "made by hand",
    "machine": {"id": "m-1", "kinematics": "p_table(A,B) = about C: Ry(A) Rx(B) p_zero, nominally",
                "nominal_centre_mm": [26.6, 54.9, -193.3], "travel_mm": {"x": 350, "y": 200, "z": 200},
                "a_limits_deg": [-100, 100], "b_limits_deg": [-360, 360]},
    "sensor": {"model": "line scanner", "noise_um": 2, "columns": 1280, "line_angle_deg": 20, "mid_range_mm": 66, "range_mm": 25},
    "artefact": {"id": "plate", "plane": "z = 0 of its own frame, 24 x 24 mm",
                 "cones_mm": {"C1": [-3.5, 0], "C2": [3.5, 3.5], "C3": [3.5, -3.5]}, "cone_half_angle_deg": 45,
                 "cone_top_radius_mm": 2, "cone_bottom_radius_mm": 0.5,
                 "slots_mm": {"Q1": [-3.5, 6.5], "Q2": [-3.5, -6.5], "Q3": [9, 0]}, "slot_width_mm": 2.4, "slot_depth_mm": 0.8},
    "touch_probe": {"frame": "table", "centres": {"C1": [201.2, 136.7, -180], "C2": [208.3, 140.2, -180]},
                    "plane": [[204, 145, -180]], "side_x": [[216, 127, -183]], "side_y": [[195, 149, -183]]},
    "sphere_poses": [{"a_deg": -60, "b_deg": 0, "centre_mm": [42.5, 58.8, -121.7], "use": "fit"},
                     {"a_deg": 60, "b_deg": 30, "centre_mm": [40.5, 50.8, -120.7], "use": "check"}],
    "part": {"id": "vane", "cad": "cad.step", "cad_unit": "mm",
             "zero_from_part_nominal": [[0, 0, 1, -270], [1, 0, 0, -6310], [0, 1, 0, -184], [0, 0, 0, 1]],
             "hole_groups": [{"name": "G1", "diameter_mm": 0.44, "depth_mm": 6, "a_nominal_deg": 1.8, "b_nominal_deg": -40.3,
                              "axis_in_part": [0, 0.6, 0.8], "position_tolerance_mm": 0.06, "inclination_tolerance_deg": 0.5,
                              "holes": [{"name": "H1", "start_in_part_mm": [6357.5, 9.1, 331.6], "normal_in_part": [0, 0, 1]}]}],
             "six_points": [{"name": "D1", "point_in_part_mm": [1, 0, 0], "normal_in_part": [0, 0, 1]},
                            {"name": "D2", "point_in_part_mm": [2, 0, 0], "normal_in_part": [0, 0, 1]},
                            {"name": "D3", "point_in_part_mm": [3, 0, 0], "normal_in_part": [0, 0, 1]},
                            {"name": "D4", "point_in_part_mm": [4, 0, 0], "normal_in_part": [0, 1, 0]},
                            {"name": "D5", "point_in_part_mm": [5, 0, 0], "normal_in_part": [0, 1, 0]},
                            {"name": "D6", "point_in_part_mm": [6, 0, 0], "normal_in_part": [1, 0, 0]}]},
    "scans": [{"id": "artefact_1", "file": "artefact_1.xyz", "kind": "artefact", "subject": "artefact:plate", "machine": "m-1",
               "v0_mm": [-190, -178, 275], "a_deg": 0, "b_deg": 0, "profile_pitch_mm": 0.05, "columns_per_profile": 1280,
               "point_count": 4},
              {"id": "sn7_b000", "file": "sn7_b000.xyz", "kind": "airfoil", "subject": "blade:SN-7", "machine": "m-1",
               "v0_mm": [-60, -90, 281], "a_deg": 0, "b_deg": 60, "profile_pitch_mm": 0.2, "columns_per_profile": 1280,
               "point_count": 4}]
  })");
}

}  // namespace sixpoint::cli
