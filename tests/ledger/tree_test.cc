// The tree against RFC 6962's published vectors, and against the definition of RFC 9162 written down once more.
#include "ledger/tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::ledger {
namespace {

using ::testing::ElementsAre;

// The eight leaves of certificate-transparency's reference (cpp/merkletree/merkle_tree_test.cc), and its roots.
std::vector<Hash> PublishedLeaves() {
  std::vector<Hash> leaves;
  for (const char* hex :
       {"", "00", "10", "2021", "3031", "40414243", "5051525354555657", "606162636465666768696a6b6c6d6e6f"})
    leaves.push_back(LeafHash(BytesOfHex(hex)));
  return leaves;
}
const char* const kPublishedRoots[] = {"6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d",
                                       "fac54203e7cc696cf0dfcb42c92a1d9dbaf70ad9e621f4bd8d98662f00e3c125",
                                       "aeb6bcfe274b70a14fb067a5e5578264db0fa9b51af5e0ba159158f329e06e77",
                                       "d37ee418976dd95753c1c73862b9398fa2a2cf9b4ff0fdfe8b30cd95209614b7",
                                       "4e3bbb1f7b478dcfe71fb631631519a3bca12c9aefca1612bfce4c13a86264d4",
                                       "76e67dadbcdf1e10e1b74ddc608abd2f98dfb16fbce75277b5232a127f2087ef",
                                       "ddb89be403809e325750d3d263cd78929c2942b7942a34b77e122c9594a74c8c",
                                       "5dc9da79a70659a9ad559cb701ded9a2ab9d823aad2f4960cfe370eff4604328"};

Hash RootOf(const std::vector<Hash>& leaves) {
  CompactRange range;
  for (const Hash& leaf : leaves) range.Append(leaf);
  return range.Root();
}

// RFC 9162, 2.1.1, word for word.
Hash ByDefinition(const std::vector<Hash>& leaves, std::size_t begin, std::size_t end) {
  if (end == begin) return EmptyRoot();
  if (end - begin == 1) return leaves[begin];
  std::size_t k = 1;
  while (2 * k < end - begin) k *= 2;
  return NodeHash(ByDefinition(leaves, begin, begin + k), ByDefinition(leaves, begin + k, end));
}

TEST(Tree, HasThePublishedRoots) {
  EXPECT_EQ(HexOf(EmptyRoot()), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  std::vector<Hash> leaves;
  for (std::size_t i = 0; i < 8; ++i) {
    leaves.push_back(PublishedLeaves()[i]);
    EXPECT_EQ(HexOf(RootOf(leaves)), kPublishedRoots[i]) << i + 1;
  }
}

TEST(Tree, HasThePublishedPaths) {
  const auto path_of = [&](std::int64_t index, std::int64_t size) {
    std::vector<std::string> path;
    for (const LeafSpan& span : PathSpans(index, size))
      path.push_back(HexOf(
          ByDefinition(PublishedLeaves(), static_cast<std::size_t>(span.begin), static_cast<std::size_t>(span.end))));
    return path;
  };
  EXPECT_THAT(path_of(0, 1), ElementsAre());
  EXPECT_THAT(path_of(0, 8), ElementsAre("96a296d224f285c67bee93c30f8a309157f0daa35dc5b87e410b78630a09cfc7",
                                         "5f083f0a1a33ca076a95279832580db3e0ef4584bdff1f54c8a360f50de3031e",
                                         "6b47aaf29ee3c2af9af889bc1fb9254dabd31177f16232dd6aab035ca39bf6e4"));
  EXPECT_THAT(path_of(5, 8), ElementsAre("bc1a0643b12e4d2d7c77918f44e0f4f79a838b6cf9ec5b5c283e1f4d88599e6b",
                                         "ca854ea128ed050b41b35ffc1b87b8eb2bde461e9e3b5596ece6b9d5975a0ae0",
                                         "d37ee418976dd95753c1c73862b9398fa2a2cf9b4ff0fdfe8b30cd95209614b7"));
  EXPECT_THAT(path_of(2, 3), ElementsAre("fac54203e7cc696cf0dfcb42c92a1d9dbaf70ad9e621f4bd8d98662f00e3c125"));
}

TEST(Tree, EveryPathProvesItsLeafAndNoOther) {
  std::vector<Hash> leaves;
  for (int size = 1; size <= 40; ++size) {
    leaves.push_back(LeafHash(std::to_string(size)));
    const Hash root = ByDefinition(leaves, 0, leaves.size());
    ASSERT_EQ(RootOf(leaves), root) << size;
    for (int index = 0; index < size; ++index) {
      std::vector<Hash> path;
      for (const LeafSpan& span : PathSpans(index, size))
        path.push_back(ByDefinition(leaves, static_cast<std::size_t>(span.begin), static_cast<std::size_t>(span.end)));
      const Hash& leaf = leaves[static_cast<std::size_t>(index)];
      EXPECT_TRUE(PathProves(leaf, index, size, path, root)) << index << " of " << size;
      EXPECT_FALSE(PathProves(LeafHash("another"), index, size, path, root));
      EXPECT_FALSE(PathProves(leaf, index, size, path, LeafHash("another")));
      if (size > 1) {
        EXPECT_FALSE(PathProves(leaf, (index + 1) % size, size, path, root)) << index << " of " << size;
        std::vector<Hash> shorter(path.begin(), path.end() - 1);
        EXPECT_FALSE(PathProves(leaf, index, size, shorter, root));
      }
      path.push_back(root);
      EXPECT_FALSE(PathProves(leaf, index, size, path, root));
    }
  }
}

TEST(Tree, GoesOnFromTheRootsOfItsSubtrees) {
  std::vector<Hash> leaves;
  for (int i = 0; i < 23; ++i) leaves.push_back(LeafHash(std::to_string(i)));
  std::map<std::pair<int, std::int64_t>, Hash> nodes;
  CompactRange whole;
  for (const Hash& leaf : leaves)
    whole.Append(leaf, [&](int level, std::int64_t index, const Hash& hash) { nodes[{level, index}] = hash; });
  CompactRange resumed;
  resumed.AppendSubtree(4, nodes.at({4, 0}));
  resumed.AppendSubtree(2, nodes.at({2, 4}));
  for (std::size_t i = 20; i < 23; ++i) resumed.Append(leaves[i]);
  EXPECT_EQ(resumed.size(), whole.size());
  EXPECT_EQ(resumed.Root(), whole.Root());
}

}  // namespace
}  // namespace sixpoint::ledger
