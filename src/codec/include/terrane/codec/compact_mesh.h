#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/mesh_level.h"

/// A mesh level in the form in which it goes to the GPU: what is left of its meshes when all that follows
/// from the diamond lattice is left out. Vertices and triangles are rebuilt from it without searching, by
/// expandMeshes() here and by render's mesh_expand.comp there, bit for bit the same.
namespace terrane {

/// 32-bit words, to be uploaded as they are; bits and halves of a word count from the lowest.
///
///     0                  mesh level in bits 0 to 3, MeshLevel::centerFalls in bit 4
///     1 + i              first word of patch i's record, which ends where the next begins, for
///     patchCount(level)
///
/// A patch's samples are those that lie in it, sides included, row by row from the north-west; they have
/// numbers from 0 on. Its record:
///
///     0                  vertices in bits 0 to 15, extra vertices in bits 16 to 31
///     1                  triangles of bisection
///     2                  triangles that replace extra vertices
///     3 ...              a bit a sample: is it a vertex?
///     ...                the extra vertices' samples, ascending, 16 bits each, up to a whole word
///     ...                the corners of the triangles that replace them, three vertices of 16 bits each, up
///     to
///                        a whole word
///     ...                of each vertex heightMeters and coarseMeters, as floats
struct CompactLevel {
  std::vector<uint32_t> words;

  int level() const { return static_cast<int>(words[0] & 15U); }
  bool centerFalls() const { return (words[0] >> 4 & 1U) != 0; }
  size_t sizeBytes() const { return words.size() * sizeof(uint32_t); }
};

/// The same of a mesh level that makeMeshLevel() made. Cost: about 3 ns a triangle.
CompactLevel compactOf(const MeshLevel& meshes);

/// The meshes of a level: what MeshLevel has of the same names. What else its patches hold is 0.
struct ExpandedMeshes {
  std::vector<MeshLevel::Patch> patches;
  std::vector<PatchVertex> vertices;
  std::vector<uint16_t> indices;
};

/// Rebuilds all vertices and triangles. Error: words that no mesh level has. Cost: about
/// 12 ns a triangle, and no more for hostile words.
Result<ExpandedMeshes> expandMeshes(const CompactLevel& compact);

/// Is it one that the GPU may be given? Sizes and counts are what they say, vertices closed under "parent
/// of", heights finite; all triangles have vertices of their patch as corners, turn from x towards y, and
/// their areas add up to the patch's. The GPU checks nothing of it. The error names the patch. Costs as much
/// as expanding.
Status validateCompactLevel(const CompactLevel& compact);

/// One patch of a valid compact level, as the GPU is told of it.
struct CompactPatch {
  size_t firstWord = 0;  ///< of its record
  size_t wordCount = 0;
  uint32_t vertexCount = 0;
  uint32_t triangleCount = 0;
  /// Ends of the hypotenuse, apex, in the order in which triangles turn; (x, y).
  std::array<std::array<int, 2>, 3> corners{};
};
CompactPatch compactPatch(const CompactLevel& compact, int index);

}  // namespace terrane
