# Every third-party library the project knows, found once. Targets name the ones they use (STYLE: one door each).
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs calib3d saliency)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(pugixml REQUIRED)
find_package(Boost 1.74 REQUIRED)
find_package(OpenSSL REQUIRED)
find_package(SQLiteCpp REQUIRED)
pkg_check_modules(apriltag REQUIRED IMPORTED_TARGET apriltag)
pkg_check_modules(tomlplusplus REQUIRED IMPORTED_TARGET tomlplusplus)
pkg_check_modules(libsystemd REQUIRED IMPORTED_TARGET libsystemd)
pkg_check_modules(tesseract REQUIRED IMPORTED_TARGET tesseract)

# The .pc file of Clipper 6.4 carries no usable version, so it is found by name.
find_path(CLIPPER_INCLUDE_DIR polyclipping/clipper.hpp REQUIRED)
find_library(CLIPPER_LIBRARY polyclipping REQUIRED)
add_library(veneer_clipper INTERFACE)
target_include_directories(veneer_clipper SYSTEM INTERFACE ${CLIPPER_INCLUDE_DIR})
target_link_libraries(veneer_clipper INTERFACE ${CLIPPER_LIBRARY})

# OpenCV's config sets include directories per variable, not per target.
add_library(veneer_opencv INTERFACE)
target_include_directories(veneer_opencv SYSTEM INTERFACE ${OpenCV_INCLUDE_DIRS})
target_link_libraries(veneer_opencv INTERFACE opencv_core opencv_imgproc opencv_imgcodecs)
