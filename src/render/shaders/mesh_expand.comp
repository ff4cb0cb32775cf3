// Vertices and triangles of patches from their compact form (codec's compact_mesh.h): a work group is a patch. What
// it reads was validated before: nothing is checked here. All places to write to come from prefix sums, so that the
// result is the same, bit for bit, in whatever order invocations run, and the CPU's.

const uint kGroupSize = 64u;
layout(local_size_x = 64) in;

struct Job {
  uint firstWord;    // of the patch's record
  uint level;        // mesh level
  uint corners[3];   // as places: x in bits 0 to 8, y in bits 9 to 17; in the order in which triangles turn
  uint firstVertex;  // to write
  uint firstIndex;
  uint slot;         // into bits 18 to 31 of each place
};
layout(std430, binding = 0) readonly buffer Jobs {
  uint jobCount;
  Job jobs[];
};
layout(std430, binding = 1) readonly buffer Compact { uint words[]; };
layout(std430, binding = 2) writeonly buffer Vertices { uint vertices[]; };
layout(std430, binding = 3) writeonly buffer Indices { uint indices[]; };

const uint kMostWords = 1037u;  // bits of the samples of the largest patch, half a tile
const uint kMostRows = 257u;
const uint kNone = 0xffffffffu;

ivec2 corners[3];
int topRow;

shared uint rowStarts[kMostRows + 1u];   // a row's first sample in bits 0 to 15, its first x in bits 16 to 31
shared uint vertexBits[kMostWords];      // a bit a sample: is it a vertex,
shared uint presentBits[kMostWords];     // or an extra vertex?
shared uint vertexRanks[kMostWords];     // vertices before the word's samples
shared uint scanValues[kGroupSize];
shared uint scanSums[kGroupSize / 8u];

// The sum of the invocations before this one's, and of all. All invocations must call it.
uint sumBefore(uint value, out uint total) {
  uint me = gl_LocalInvocationID.x;
  barrier();
  scanValues[me] = value;
  barrier();
  if (me < kGroupSize / 8u) {
    uint sum = 0u;
    for (uint i = 0u; i < 8u; ++i) sum += scanValues[me * 8u + i];
    scanSums[me] = sum;
  }
  barrier();
  uint before = 0u;
  total = 0u;
  for (uint i = 0u; i < kGroupSize / 8u; ++i) {
    if (i == me / 8u) before = total;
    total += scanSums[i];
  }
  for (uint i = me & ~7u; i < me; ++i) before += scanValues[i];
  return before;
}

// ---- samples

ivec2 pointAt(uint place) {
  return ivec2(bitfieldExtract(place, 0, 9), bitfieldExtract(place, 9, 9));
}

// First and last x of a row of the patch. All its sides run along rows, columns or diagonals.
ivec2 spanOfRow(int y) {
  ivec2 span = ivec2(0, 512);
  for (int i = 0; i < 3; ++i) {
    ivec2 p = corners[i];
    ivec2 along = corners[(i + 1) % 3] - p;
    if (along.y == 0) continue;
    int x = p.x + (y - p.y) * (along.x / along.y);
    if (along.y < 0) {
      span.x = max(span.x, x);
    } else {
      span.y = min(span.y, x);
    }
  }
  return span;
}

// A point's sample; kNone outside of the patch.
uint sampleAt(ivec2 p, int rowCount) {
  int row = p.y - topRow;
  if (row < 0 || row >= rowCount) return kNone;
  uint start = rowStarts[row];
  uint first = start & 0xffffu;
  uint at = uint(p.x - int(start >> 16));  // note: west of the row it is huge
  return at < (rowStarts[row + 1] & 0xffffu) - first ? first + at : kNone;
}

// A vertex's number; kNone where there is none.
uint vertexAt(ivec2 p, int rowCount) {
  uint at = sampleAt(p, rowCount);
  if (at == kNone) return kNone;
  uint bits = vertexBits[at >> 5];
  uint below = (1u << (at & 31u)) - 1u;
  return (bits >> (at & 31u) & 1u) != 0u ? vertexRanks[at >> 5] + uint(bitCount(bits & below)) : kNone;
}

bool isPresent(ivec2 p, int rowCount) {
  uint at = sampleAt(p, rowCount);
  return at != kNone && (presentBits[at >> 5] >> (at & 31u) & 1u) != 0u;
}

// The place of the nth bit that is set, counted from 0.
uint placeOfBit(uint bits, uint n) {
  uint at = 0u;
  for (uint width = 16u; width > 0u; width >>= 1) {
    uint low = uint(bitCount(bitfieldExtract(bits, int(at), int(width))));
    if (n >= low) {
      n -= low;
      at += width;
    }
  }
  return at;
}

// The number of a 16-bit list's entry.
uint halfAt(uint firstWord, uint index) {
  return words[firstWord + (index >> 1)] >> ((index & 1u) * 16u) & 0xffffu;
}

void main() {
  uint me = gl_LocalInvocationID.x;
  uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  if (group >= jobCount) return;
  Job job = jobs[group];
  for (int i = 0; i < 3; ++i) corners[i] = pointAt(job.corners[i]);
  topRow = min(corners[0].y, min(corners[1].y, corners[2].y));
  int rowCount = max(corners[0].y, max(corners[1].y, corners[2].y)) - topRow + 1;

  // Where each row begins.
  uint sampleCount = 0u;
  for (int first = 0; first <= rowCount; first += int(kGroupSize)) {
    int row = first + int(me);
    ivec2 span = row < rowCount ? spanOfRow(topRow + row) : ivec2(0, -1);
    uint total;
    uint start = sampleCount + sumBefore(uint(span.y - span.x + 1), total);
    if (row <= rowCount) rowStarts[row] = start | uint(span.x) << 16;
    sampleCount += total;
  }

  // Where the record's parts are.
  uint vertexCount = words[job.firstWord] & 0xffffu;
  uint extraCount = words[job.firstWord] >> 16;
  uint bisected = words[job.firstWord + 1u];
  uint replacing = words[job.firstWord + 2u];
  uint bitmap = job.firstWord + 3u;
  uint bitmapWords = (sampleCount + 31u) >> 5;
  uint extras = bitmap + bitmapWords;
  uint replacingCorners = extras + ((extraCount + 1u) >> 1);
  uint heights = replacingCorners + ((3u * replacing + 1u) >> 1);

  // Bits, and the numbers of vertices.
  uint counted = 0u;
  for (uint first = 0u; first < bitmapWords; first += kGroupSize) {
    uint word = first + me;
    uint bits = word < bitmapWords ? words[bitmap + word] : 0u;
    uint total;
    uint rank = counted + sumBefore(uint(bitCount(bits)), total);
    counted += total;
    if (word < bitmapWords) {
      vertexBits[word] = bits;
      vertexRanks[word] = rank;
      // Its extra vertices begin with the first at or after its first sample.
      uint low = 0u;
      uint high = extraCount;
      while (low < high) {
        uint middle = (low + high) >> 1;
        if (halfAt(extras, middle) >> 5 < word) {
          low = middle + 1u;
        } else {
          high = middle;
        }
      }
      for (; low < extraCount && halfAt(extras, low) >> 5 == word; ++low)
        bits |= 1u << (halfAt(extras, low) & 31u);
      presentBits[word] = bits;
    }
  }
  barrier();

  // Vertices, one an invocation, and the triangles of bisection that their splits made.
  bool isSplit = isPresent((corners[0] + corners[1]) / 2, rowCount);
  uint written = 0u;
  for (uint first = 0u; first < vertexCount; first += kGroupSize) {
    uint vertex = first + me;
    uint count = 0u;
    uint ring[4];
    bool isLeaf[4] = bool[4](false, false, false, false);
    if (vertex < vertexCount) {
      // The last word that begins at or before it, its bit, the row that holds it.
      uint low = 0u;
      uint high = bitmapWords;
      while (high - low > 1u) {
        uint middle = (low + high) >> 1;
        if (vertexRanks[middle] <= vertex) {
          low = middle;
        } else {
          high = middle;
        }
      }
      uint at = low * 32u + placeOfBit(vertexBits[low], vertex - vertexRanks[low]);
      int row = 0;
      int rowEnd = rowCount;
      while (rowEnd - row > 1) {
        int middle = (row + rowEnd) >> 1;
        if ((rowStarts[middle] & 0xffffu) <= at) {
          row = middle;
        } else {
          rowEnd = middle;
        }
      }
      ivec2 p = ivec2(int(rowStarts[row] >> 16) + int(at - (rowStarts[row] & 0xffffu)), topRow + row);

      uint target = (job.firstVertex + vertex) * 3u;
      vertices[target] = uint(p.x) | uint(p.y) << 9 | job.slot << 18;
      vertices[target + 1u] = words[heights + 2u * vertex];
      vertices[target + 2u] = words[heights + 2u * vertex + 1u];

      // Its diamond: half-size, kind and level. Corners of the tile have none; what is coarser than the level is a
      // corner of the patch.
      int shift = findLSB(p.x | p.y);
      bool isQuad = shift >= 0 && (p.x & p.y & 1 << shift) != 0;
      bool isCoarse = shift < 0 || shift > 7 || 2 * (7 - shift) + (isQuad ? 0 : 1) < int(job.level);
      if (isSplit && !isCoarse) {
        ivec2 a = (isQuad ? ivec2(-1, -1) : ivec2(0, -1)) * (1 << shift);
        ivec2 around[4];
        for (int i = 0; i < 4; ++i) {
          around[i] = a;
          ring[i] = vertexAt(p + a, rowCount);
          a = ivec2(-a.y, a.x);
        }
        bool areLast = !isQuad && shift == 0;
        for (int i = 0; i < 4; ++i) {
          int next = (i + 1) & 3;
          isLeaf[i] = ring[i] != kNone && ring[next] != kNone &&
                      (areLast || !isPresent(p + (around[i] + around[next]) / 2, rowCount));
          count += isLeaf[i] ? 1u : 0u;
        }
      }
    }
    uint total;
    uint triangle = written + sumBefore(count, total);
    written += total;
    uint target = job.firstIndex + 3u * triangle;
    for (int i = 0; i < 4; ++i) {
      if (!isLeaf[i]) continue;
      indices[target] = job.firstVertex + ring[i];
      indices[target + 1u] = job.firstVertex + ring[(i + 1) & 3];
      indices[target + 2u] = job.firstVertex + vertex;
      target += 3u;
    }
  }
  if (!isSplit && me < 3u) indices[job.firstIndex + me] = job.firstVertex + vertexAt(corners[me], rowCount);

  // And those that replace extra vertices.
  for (uint i = me; i < 3u * replacing; i += kGroupSize)
    indices[job.firstIndex + 3u * bisected + i] = job.firstVertex + halfAt(replacingCorners, i);
}
