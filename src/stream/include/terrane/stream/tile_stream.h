#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "terrane/codec/imagery_codec.h"
#include "terrane/codec/tile.h"
#include "terrane/dataset/manifest.h"
#include "terrane/stream/tile_key.h"
#include "terrane/stream/transport.h"
#include "terrane/stream/workers.h"

namespace terrane {

/// A tile that would improve the picture, and by how much.
struct StreamWish {
  TileKey key;
  double nowPixels = 0.0;     ///< error on screen, or size of a texel, while it is not here
  double afterPixels = 0.0;   ///< the same once it is
  double targetPixels = 1.0;  ///< what is aimed at
  double areaPixels = 0.0;    ///< of the picture, that it concerns
  /// That it is seen when it arrives. Below 1: fetched when nothing else is wanted. Well below a half: for
  /// later, so it may wait a second or two for others that come with the same request.
  double chance = 1.0;
};

struct StreamOptions {
  uint64_t compressedBytes = 64U << 20;  ///< kept as they came
  uint64_t decodedBytes = 256U << 20;    ///< kept decoded, elevation; what is in use stays whatever this says
  uint64_t pictureBytes = 64U << 20;     ///< kept decoded, imagery
  int mostRequests = 12;                 ///< at once
  uint64_t firstBytes = 64U << 10;       ///< of an archive, over a quick line: its coarsest tiles come along
  bool inOrder = false;  ///< fetch in the order of the wishes, all at once, whole: for comparison
};

enum class StreamPhase : uint8_t {
  Opening,  ///< manifest and directories are on the way
  Ready,
  Failed,  ///< for good: error() says why
};

struct StreamStatistics {
  uint64_t requests = 0;  ///< started
  uint64_t requestsFailed = 0;
  uint64_t requestsCancelled = 0;
  uint64_t bytesReceived = 0;
  uint64_t bytesUnwanted = 0;  ///< of these, gaps and what was not wanted any more
  uint64_t tilesReceived = 0;
  uint64_t tilesDecoded = 0;
  uint64_t tilesDamaged = 0;  ///< that could not be decoded, each time
  uint64_t tilesLost = 0;     ///< now given up: a coarser surface stands for them
  uint64_t requestsUnderway = 0;
  uint64_t bytesUnderway = 0;
  uint64_t wishes = 0;  ///< of the last want() that are neither here nor given up
  uint64_t wishedBytes = 0;
  double debt = 0.0;       ///< pixels of error above target, times the pixels that have them
  double looseness = 1.0;  ///< by how much the target is missed on purpose, since the line cannot keep up
  double bytesPerSecond = 0.0;  ///< of the line, estimated
  double latencySeconds = 0.0;
  bool isOffline = false;  ///< the last tries found no server
  uint64_t compressedBytes = 0, compressedHits = 0;
  uint64_t decodedBytes = 0, decodedTiles = 0;
  uint64_t pictureBytes = 0;
};

/// Makes a dataset's tiles be there: fetches what is wished for in the order of what it is worth, decodes it
/// aside, and keeps it within budgets (docs/architecture.md, "Streaming"). Nothing here waits. One thread;
/// the workers have their own.
///
/// A dataset's later layers of significance are opened beside all else, and a tile is what it is with those
/// that could be had: where a refinement is given up, the layers before it stand for the tile.
///
/// Over a thin line roots come in parts, and are sketched from what is there (isSketch()) until they are
/// whole: they stand for everything.
///
/// A tile that cannot be had (no such range, or damaged time after time) is given up for a minute or for
/// good, and a coarser surface stands for it. A server that is away is asked again, ever more rarely, for as
/// long as it takes.
class TileStream {
 public:
  /// `workers` must outlive the stream.
  TileStream(std::unique_ptr<Transport> transport, Workers& workers, const StreamOptions& options = {});
  ~TileStream();
  TileStream(const TileStream&) = delete;
  TileStream& operator=(const TileStream&) = delete;

  StreamPhase phase() const;
  /// Why it Failed, or what went wrong last.
  const std::string& problem() const;
  /// Only when Ready.
  const Manifest& manifest() const;

  /// Takes in what has come, and starts what can be started. `nowSeconds` must not run backwards.
  void poll(double nowSeconds);
  /// Replaces what is wished for. Elevation tiles may be wished for before their parents, and in a layer of
  /// significance before they are here in those before it: all that is needed comes along, and first.
  void want(std::span<const StreamWish> wishes);
  /// Elevation tiles that must stay decoded, with all layers that they have and their ancestors with them,
  /// until the next call.
  void hold(std::span<const TileId> tiles);

  /// Is the tile in its archive? Where the directory has not come yet: perhaps, and it will be fetched.
  bool isStored(const TileKey& key) const;
  /// Will it not come, for now?
  bool isLost(const TileKey& key) const;
  /// A decoded tile with as many layers of significance as are here (TileSamples::layerCount), or null;
  /// another pointer takes its place when it gets more. Stays valid as long as the pointer is held, whatever
  /// the stream forgets.
  std::shared_ptr<const Tile> elevation(TileId id) const;
  std::shared_ptr<const ImageryTile> picture(const TileKey& key) const;
  /// Is what elevation() or picture() gives a root of which only a beginning is here? No child comes before
  /// it is whole; another pointer then takes its place.
  bool isSketch(const TileKey& key) const;
  /// The tiles that have been decoded since the last call, parents before children, each layer of
  /// significance by itself.
  std::vector<TileKey> takeNews();

  /// Nothing is under way, and nothing that is wished for can still come.
  bool isIdle() const;
  /// Is anything being decoded?
  bool isDecoding() const;
  StreamStatistics statistics() const;
  const std::string& where() const;

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace terrane
