#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "terrane/base/check.h"

namespace terrane {

/// Why something could not be done, in words for the person who asked: what, where (file, tile, byte,
/// line) and what to do about it. One sentence or two, no trailing newline.
struct Error {
  std::string message;
};

/// Makes an Error with fmt's syntax: `return makeError("{}: no CRS; pass --source-crs", path);`
template <class... Args>
Error makeError(fmt::format_string<Args...> format, Args&&... args) {
  return Error{fmt::format(format, std::forward<Args>(args)...)};
}

/// A value, or the reason why there is none. Bad data, bad arguments and the network end here; a broken
/// contract inside the program is TERRANE_CHECK instead. Nothing is thrown across a folder's border.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  /// The value; only when ok().
  T& value() & { return *checked(); }
  const T& value() const& { return *const_cast<Result*>(this)->checked(); }
  T&& value() && { return std::move(*checked()); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return checked(); }
  const T* operator->() const { return const_cast<Result*>(this)->checked(); }

  /// The error; only when !ok().
  const Error& error() const {
    TERRANE_CHECK(!ok(), "error() of a result that holds a value");
    return *std::get_if<1>(&state_);
  }

 private:
  T* checked() {
    TERRANE_CHECK(ok(), "value() of a failed result: {}", std::get_if<1>(&state_)->message);
    return std::get_if<0>(&state_);
  }
  std::variant<T, Error> state_;
};

/// Success, or the reason why not.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}
  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    TERRANE_CHECK(error_.has_value(), "error() of a status that is fine");
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

/// Leaves the calling function with the error, if there is one.
#define TERRANE_TRY(expression)                                     \
  do {                                                              \
    if (auto terraneStatus_ = (expression); !terraneStatus_.ok()) { \
      return terraneStatus_.error();                                \
    }                                                               \
  } while (false)

#define TERRANE_CONCAT_INNER_(a, b) a##b
#define TERRANE_CONCAT_(a, b) TERRANE_CONCAT_INNER_(a, b)

/// `TERRANE_ASSIGN(auto tile, readTile(id));` declares `tile`, or leaves with the error.
#define TERRANE_ASSIGN(declaration, expression) \
  TERRANE_ASSIGN_IMPL_(TERRANE_CONCAT_(terraneResult_, __LINE__), declaration, expression)
#define TERRANE_ASSIGN_IMPL_(result, declaration, expression) \
  auto result = (expression);                                 \
  if (!result.ok()) return result.error();                    \
  declaration = std::move(result).value()

}  // namespace terrane
