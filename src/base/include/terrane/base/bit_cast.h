#pragma once

#include <cstring>
#include <type_traits>

namespace terrane {

/// The same bits as another type of the same size: C++20's std::bit_cast, which emscripten's library lacks.
template <class To, class From>
To bitCast(const From& from) {
  static_assert(sizeof(To) == sizeof(From) && std::is_trivially_copyable_v<To> &&
                std::is_trivially_copyable_v<From>);
  To to;
  std::memcpy(&to, &from, sizeof(to));
  return to;
}

}  // namespace terrane
