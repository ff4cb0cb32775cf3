#pragma once

#include "terrane/lod/morph_history.h"

namespace terrane {

/// How long a diamond takes to fade in after its tiles have come, at most.
inline constexpr double kRampSeconds = 0.3;

/// The diamonds that fade in during one selection: what is left from the selection before, moved on by the
/// time in between, and what begins now.
///
/// One continuous time: a diamond whose parents are done 4 ms before this moment begins then, and is 4 ms on
/// its way. So a chain of levels takes as long at 20 frames a second as at 200.
class MorphRamps {
 public:
  /// Without a history nothing ever fades.
  MorphRamps(MorphHistory* history, int latticeDepth, int k, double elapsedSeconds);

  /// How far one diamond, or two parents together, have faded in.
  struct Progress {
    double share = 1.0;         ///< 1: as far as the camera asks
    double secondsSince = 0.0;  ///< how long ago it became so; only where `moved`
    bool moved = false;         ///< it was below 1 at some time since the last selection
    bool done() const { return share >= 1.0; }
    /// Both must be done.
    static Progress both(const Progress& a, const Progress& b);
  };

  /// The diamond would split but for its tiles.
  void holdBack(const Diamond& d);
  /// The diamond splits. `parents`: done, both of them. `wanted`: the morph that the camera asks for, which
  /// is as far as it has to fade in. `excess`: how many times too coarse it is without, perhaps infinite:
  /// what is far too coarse fades faster, so that a chain of many levels takes little longer than one.
  Progress advance(const Diamond& d, const Progress& parents, double wanted, double excess);

  /// Hands over to the next selection. Returns how many diamonds are on their way.
  int finish();

 private:
  MorphHistory* history_;
  MorphHistory next_;
  double elapsedSeconds_;
};

}  // namespace terrane
