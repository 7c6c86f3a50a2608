// How tables refer to scans: by the time-ordered key of the scan's name, which stays where the scan's own month was detached.
// Private to storage.
#pragma once

// The key of scans/{id} ($n); NULL, which no table takes, where there is no such scan.
#define SIXPOINT_SCAN_KEY(id) "(SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || " id "::text)"
// The id of a key: the name without "scans/".
#define SIXPOINT_SCAN_ID(key) "(SELECT substr(n.name, 7) FROM record_names n WHERE n.record_id = " key ")"
