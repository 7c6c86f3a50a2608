// A provider's keys, for who judges its tokens. Private to the room.
#pragma once

#include <string>
#include <vector>

#include "identity/id_token.h"
#include "identity/openssl_objects.h"

namespace sixpoint::identity {

struct ProviderKey {
  std::string id;         // kid; empty: none
  std::string algorithm;  // alg; empty: any of its kind
  Key key;
};

struct KeySet::Keys {
  std::vector<ProviderKey> keys;
};

}  // namespace sixpoint::identity
