#pragma once

namespace terrane {

/// Texture units of what stages over the finished ground read; those below are the ground's own.
inline constexpr int kStageSceneUnit = 0;
inline constexpr int kPlacesUnit = 7;
inline constexpr int kLineCellsUnit = 8;
inline constexpr int kLineEntriesUnit = 9;
inline constexpr int kLineStylesUnit = 10;

}  // namespace terrane
