#include "terrane/tiling/flight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <random>
#include <sstream>

namespace terrane {
namespace {

const char* const kFlights[] = {"p1_dolly",    "p2_straight", "p3_descent", "p4_heights",
                                "p5_turnover", "hover_spin",  "valley"};

std::string readFlight(const std::string& name) {
  std::ifstream file(std::string(TERRANE_SOURCE_DIR) + "/bench/flights/" + name + ".json");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Hills on a box of `width` x `height` metres, with a hole in one corner.
FlightGround hills(double width, double height, double relief) {
  FlightGround ground;
  ground.southWestLocal = {0.0, -height};
  ground.northEastLocal = {width, 0.0};
  ground.minHeight = 100.0;
  ground.maxHeight = 100.0 + relief;
  ground.heightAt = [=](glm::dvec2 p) {
    if (p.x < 0.0 || p.y > 0.0 || p.x > width || p.y < -height) return std::nan("");
    if (p.x < 0.1 * width && p.y > -0.1 * height) return std::nan("");
    return 100.0 + 0.25 * relief * (2.0 + std::sin(17.0 * p.x / width) + std::cos(23.0 * p.y / height));
  };
  return ground;
}

bool finite(const Camera& camera) {
  for (const glm::dvec3& v : {camera.eyeLocal, camera.right, camera.up, camera.forward}) {
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return false;
  }
  return std::isfinite(camera.fovyRadians) && camera.fovyRadians > 0.0;
}

TEST(Flight, TheSevenFitAnyGround) {
  const Frame frame{.spacingX = 10.0, .spacingY = 10.0};
  for (const char* name : kFlights) {
    const auto flight = flightFromJson(readFlight(name), name);
    ASSERT_TRUE(flight.ok()) << flight.error().message;
    EXPECT_EQ(flight->name, name);
    for (const FlightGround& ground : {hills(30000, 14000, 1200), hills(900, 4000, 30), hills(5e5, 5e5, 0)}) {
      const auto fitted = fitFlight(*flight, frame, ground);
      ASSERT_TRUE(fitted.ok()) << fitted.error().message;
      const bool inTheBox = flight->seekLowMeters == 0.0;
      for (double time = -1.0; time < flight->durationSeconds() + 1.0; time += 0.0371) {
        const Camera camera = fitted->at(time, 640, 360);
        ASSERT_TRUE(finite(camera)) << name << " at " << time;
        EXPECT_NEAR(glm::length(camera.up), 1.0, 1e-9);
        EXPECT_NEAR(glm::dot(camera.up, camera.forward), 0.0, 1e-9);
        const glm::dvec2 place(camera.eyeLocal.x, camera.eyeLocal.y);
        if (inTheBox) {
          EXPECT_GE(place.x, ground.southWestLocal.x) << name << " at " << time;
          EXPECT_LE(place.x, ground.northEastLocal.x) << name << " at " << time;
          EXPECT_GE(place.y, ground.southWestLocal.y) << name << " at " << time;
          EXPECT_LE(place.y, ground.northEastLocal.y) << name << " at " << time;
        }
        const double height = ground.heightAt(place);
        EXPECT_FALSE(camera.eyeLocal.z <= height) << name << " at " << time;  // true where there is no ground
      }
    }
  }
}

TEST(Flight, KeepsTheSpeedsThatItIsNamedFor) {
  // On ground of the designed size, scale 1.
  const Frame frame{.spacingX = 10.0, .spacingY = 10.0};
  const auto speed = [&](const char* name, double halfSide, double time) {
    const auto flight = flightFromJson(readFlight(name), name);
    EXPECT_TRUE(flight.ok());
    EXPECT_EQ(flight->halfSideMeters, halfSide);
    const auto fitted = fitFlight(*flight, frame, hills(2 * halfSide, 2 * halfSide, 0));
    EXPECT_EQ(fitted->scale(), 1.0);
    const glm::dvec3 way =
        fitted->at(time + 0.05, 64, 64).eyeLocal - fitted->at(time - 0.05, 64, 64).eyeLocal;
    return glm::length(glm::dvec2(way.x, way.y)) / 0.1 * 3.6;
  };
  EXPECT_NEAR(speed("p2_straight", 60000, 15.0), 14000.0, 50.0);
  EXPECT_NEAR(speed("p3_descent", 7500, 0.5), 2000.0, 250.0);
  EXPECT_NEAR(speed("p3_descent", 7500, 62.0), 63.0, 15.0);
  EXPECT_NEAR(speed("p3_descent", 7500, 72.5), 80.0, 20.0);
  EXPECT_NEAR(speed("p5_turnover", 10000, 6.0) / 3.6 / 30.0, 0.03 * 2.0 * 2000.0 * std::tan(0.3926990817),
              0.5);
}

TEST(Flight, ScalesWithTheDataset) {
  const Frame frame{.spacingX = 10.0, .spacingY = 10.0};
  const Frame twice{.spacingX = 20.0, .spacingY = 20.0};
  for (const char* name : kFlights) {
    const auto flight = flightFromJson(readFlight(name), name);
    ASSERT_TRUE(flight.ok());
    FlightGround small = hills(8000, 6000, 500);
    FlightGround large = hills(16000, 12000, 1000);
    large.minHeight = 200.0;
    large.maxHeight = 1200.0;
    large.heightAt = [small](glm::dvec2 p) { return 2.0 * small.heightAt(0.5 * p); };
    const auto near = fitFlight(*flight, frame, small);
    const auto far = fitFlight(*flight, twice, large);
    for (double time = 0.0; time <= flight->durationSeconds(); time += 0.5) {
      const Camera a = near->at(time, 640, 360);
      const Camera b = far->at(time, 640, 360);
      EXPECT_NEAR(glm::length(b.eyeLocal - 2.0 * a.eyeLocal), 0.0, 1e-6) << name << " at " << time;
      EXPECT_NEAR(glm::length(b.forward - a.forward), 0.0, 1e-9) << name << " at " << time;
    }
  }
}

TEST(Flight, StandsWhereItsCrsSays) {
  const Frame frame{.originEasting = 500000,
                    .originNorthing = 4200000,
                    .spacingX = 30,
                    .spacingY = 30,
                    .metersPerUnit = 0.3048};
  const auto flight =
      flightFromJson(R"({"terraneFlight": 1, "coordinates": "crs", "look": "target", "fovy": 30,
    "keys": [{"time": 0, "eye": [500100, 4199000, 900], "target": [500100, 4199900, 900]},
             {"time": 4, "eye": [500300, 4199000, 700], "target": [500300, 4199900, 700]}]})",
                     "test");
  ASSERT_TRUE(flight.ok()) << flight.error().message;
  const auto fitted = fitFlight(*flight, frame, hills(9000, 9000, 100));
  const Camera camera = fitted->at(4.0, 64, 64);
  const glm::dvec3 crs = frame.crsFromLocal(camera.eyeLocal);
  EXPECT_NEAR(glm::length(crs - glm::dvec3(500300, 4199000, 700)), 0.0, 1e-6);
  EXPECT_NEAR(camera.forward.y, 1.0, 1e-12);
  EXPECT_NEAR(camera.fovyRadians, 30.0 * 3.14159265358979 / 180.0, 1e-9);
}

TEST(Flight, SaysWhatIsWrong) {
  const auto message = [](const std::string& text) {
    const auto flight = flightFromJson(text, "f.json");
    return flight.ok() ? std::string("fine") : flight.error().message;
  };
  const auto withKeys = [](const std::string& keys) {
    return R"({"terraneFlight": 1, "halfSide": 100, "look": "ahead", "keys": )" + keys + "}";
  };
  EXPECT_EQ(message(withKeys(R"([{"time": 0, "eye": [0, 0, 1]}])")), "fine");
  EXPECT_NE(message("{").find("not JSON"), std::string::npos);
  EXPECT_NE(message("{\n  7").find("line 2"), std::string::npos) << message("{\n  7");
  EXPECT_NE(message("[]").find("not a flight"), std::string::npos);
  EXPECT_NE(message(R"({"terraneFlight": 2})").find("version"), std::string::npos);
  EXPECT_NE(message(withKeys("[]")).find("\"keys\""), std::string::npos);
  EXPECT_NE(message(withKeys("[7]")).find("keys[0]"), std::string::npos);
  EXPECT_NE(message(withKeys(R"([{"time": 1, "eye": [0, 0, 1]}])")).find("keys[0].time"), std::string::npos);
  EXPECT_NE(message(withKeys(R"([{"time": 0, "eye": [0, 1]}])")).find("keys[0].eye"), std::string::npos);
  EXPECT_NE(message(withKeys(R"([{"time": 0, "eye": [0, 0, 1e30]}])")).find("keys[0].eye"),
            std::string::npos);
  EXPECT_NE(message(withKeys(R"([{"time": 0, "eye": [0, 0, 1e999]}])")).find("f.json"), std::string::npos);
  EXPECT_NE(message(withKeys(R"([{"time": 0, "eye": [0, 0, 1], "pich": 3}])")).find("keys[0].pich"),
            std::string::npos);
  EXPECT_NE(message(withKeys(R"([{"time": 0, "eye": [0, 0, 1]}, {"time": 0, "eye": [0, 0, 1]}])"))
                .find("keys[1].time"),
            std::string::npos);
  EXPECT_NE(message(R"({"terraneFlight": 1, "look": "around", "keys": []})").find("\"look\" is \"around\""),
            std::string::npos);
  EXPECT_NE(message(R"({"terraneFlight": 1, "keys": [{"time": 0, "eye": [0, 0, 1], "target": [0, 0, 0]}]})")
                .find("halfSide"),
            std::string::npos);
}

TEST(Flight, SurvivesEveryCutAndManyChanges) {
  const std::string text = readFlight("p4_heights");
  for (size_t length = 0; length < text.size(); ++length) {
    const auto flight = flightFromJson(text.substr(0, length), "cut");
    EXPECT_TRUE(!flight.ok() || length + 3 > text.size()) << length;
  }
  std::mt19937 random(11);
  const Frame frame{.spacingX = 10.0, .spacingY = 10.0};
  for (int i = 0; i < 3000; ++i) {
    std::string changed = text;
    for (int j = 0; j < 3; ++j) changed[random() % changed.size()] = "0123456789-.eE[]{},\" "[random() % 21];
    const auto flight = flightFromJson(changed, "changed");
    if (!flight.ok()) continue;
    const auto fitted = fitFlight(*flight, frame, hills(500, 700, 40));
    ASSERT_TRUE(fitted.ok());
    for (int step = 0; step <= 10; ++step) {
      EXPECT_TRUE(finite(fitted->at(flight->durationSeconds() * step / 10.0, 64, 64)));
    }
  }
}

TEST(Flight, OneKeyIsAStill) {
  const auto flight = flightFromJson(
      R"({"terraneFlight": 1, "halfSide": 100, "look": "ahead", "keys": [{"time": 0, "eye": [0, 0, 10], "pitch": -5}]})",
      "still");
  ASSERT_TRUE(flight.ok());
  const auto fitted = fitFlight(*flight, Frame{}, hills(200, 200, 0));
  const Camera camera = fitted->at(3.0, 64, 64);
  EXPECT_NEAR(glm::length(camera.eyeLocal - glm::dvec3(100, -100, 110)), 0.0, 1e-9);
  EXPECT_NEAR(camera.forward.y, std::cos(5.0 * 3.14159265358979 / 180.0), 1e-9);
}

TEST(Flight, NeedsGround) {
  const auto flight = flightFromJson(readFlight("valley"), "valley");
  FlightGround nothing = hills(0, 100, 0);
  EXPECT_FALSE(fitFlight(*flight, Frame{}, nothing).ok());
  FlightGround voids = hills(1000, 1000, 10);
  voids.heightAt = [](glm::dvec2) { return std::nan(""); };
  const auto fitted = fitFlight(*flight, Frame{}, voids);
  ASSERT_TRUE(fitted.ok());
  EXPECT_TRUE(finite(fitted->at(10.0, 64, 64)));
}

}  // namespace
}  // namespace terrane
