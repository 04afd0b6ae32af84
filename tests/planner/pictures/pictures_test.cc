#include "planner/pictures/pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <jpeglib.h>
#include <lcms2.h>
#include <tiffio.h>
#include <zlib.h>

#include "base/files.h"
#include "planner/pictures/picture_metadata.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class Pictures : public ::testing::Test {
 protected:
  Pictures() : folder_(fs::temp_directory_path() / ("pictures_test_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~Pictures() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path file(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  fs::path picture(const std::string& name, const cv::Mat& pixels, const std::vector<int>& how = {}) const {
    cv::imwrite((folder_ / name).string(), pixels, how);
    return folder_ / name;
  }
  // Writes a TIFF of 8-bit samples, rows one after the other.
  fs::path tiff(const std::string& name, const cv::Mat& samples, const std::function<void(TIFF*)>& tags) const {
    TIFF* out = TIFFOpen((folder_ / name).c_str(), "w");
    TIFFSetField(out, TIFFTAG_IMAGEWIDTH, samples.cols);
    TIFFSetField(out, TIFFTAG_IMAGELENGTH, samples.rows);
    TIFFSetField(out, TIFFTAG_BITSPERSAMPLE, samples.depth() == CV_8U ? 8 : 16);
    TIFFSetField(out, TIFFTAG_SAMPLESPERPIXEL, samples.channels());
    TIFFSetField(out, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(out, TIFFTAG_ROWSPERSTRIP, samples.rows);
    tags(out);
    for (int r = 0; r < samples.rows; ++r)
      TIFFWriteScanline(out, const_cast<uchar*>(samples.ptr(r)), static_cast<std::uint32_t>(r), 0);
    TIFFClose(out);
    return folder_ / name;
  }
  fs::path folder_;
};

std::string encoded(const char* format, const cv::Mat& pixels) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(format, pixels, bytes);
  return {bytes.begin(), bytes.end()};
}

std::string big_endian(std::size_t value, int bytes) {
  std::string out;
  for (int i = bytes - 1; i >= 0; --i) out += static_cast<char>(value >> 8 * i & 0xFF);
  return out;
}

std::string exif(int orientation) {
  using std::string_literals::operator""s;
  std::string out = "MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"s;
  out += static_cast<char>(orientation);
  return out.append(6, '\0');
}

// 300 pixels for an inch, of a value that claims to have this type.
constexpr int kRationalType = 5;
std::string exif_resolution(int type) {
  using std::string_literals::operator""s;
  std::string out = "MM\0\x2a\0\0\0\x08"s;
  for (const std::string& part :
       {big_endian(1, 2), big_endian(0x11A, 2), big_endian(static_cast<std::size_t>(type), 2), big_endian(1, 4),
        big_endian(26, 4), big_endian(0, 4), big_endian(300, 4), big_endian(1, 4)})
    out += part;
  return out;
}

std::string jpeg_segment(char marker, const std::string& body) {
  return std::string("\xFF") + marker + big_endian(body.size() + 2, 2) + body;
}

std::string png_chunk(const std::string& kind, const std::string& body) {
  const std::string checked = kind + body;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
  return big_endian(body.size(), 4) + checked + big_endian(sum, 4);
}

// Right behind a PNG's header, where colour chunks belong.
std::string with_chunk(std::string png, const std::string& chunk) { return png.insert(8 + 25, chunk); }

std::string little_endian(std::size_t value, int bytes) {
  std::string out = big_endian(value, bytes);
  std::reverse(out.begin(), out.end());
  return out;
}

std::string webp_with_profile(const cv::Mat& picture, const std::string& icc_profile) {
  const auto chunk = [](const std::string& kind, const std::string& body) {
    return kind + little_endian(body.size(), 4) + body + std::string(body.size() % 2, '\0');
  };
  const std::string has_profile = little_endian(0x20, 4);
  const std::string inside = "WEBP" +
                             chunk("VP8X", has_profile + little_endian(static_cast<std::size_t>(picture.cols) - 1, 3) +
                                               little_endian(static_cast<std::size_t>(picture.rows) - 1, 3)) +
                             chunk("ICCP", icc_profile) + encoded(".webp", picture).substr(12);
  return chunk("RIFF", inside);
}

std::string deflated(const std::string& plain) {
  uLongf size = compressBound(static_cast<uLong>(plain.size()));
  std::string out(size, '\0');
  compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(plain.data()),
           static_cast<uLong>(plain.size()));
  out.resize(size);
  return out;
}

std::string saved(cmsHPROFILE profile) {
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string out(size, '\0');
  cmsSaveProfileToMem(profile, out.data(), &size);
  cmsCloseProfile(profile);
  return out;
}

// Numbers proportional to light: 128 of 255 is half the light, which sRGB writes as 188.
constexpr int kHalfTheLight = 188;

std::string linear_rgb_profile() {
  const cmsCIExyY white{0.3127, 0.3290, 1};
  const cmsCIExyYTRIPLE primaries{{0.64, 0.33, 1}, {0.30, 0.60, 1}, {0.15, 0.06, 1}};
  cmsToneCurve* linear = cmsBuildGamma(nullptr, 1);
  cmsToneCurve* curves[3] = {linear, linear, linear};
  const std::string out = saved(cmsCreateRGBProfile(&white, &primaries, curves));
  cmsFreeToneCurve(linear);
  return out;
}

std::string linear_grey_profile() {
  cmsToneCurve* linear = cmsBuildGamma(nullptr, 1);
  const std::string out = saved(cmsCreateGrayProfile(cmsD50_xyY(), linear));
  cmsFreeToneCurve(linear);
  return out;
}

// A printer on which full cyan is black and the other inks leave no trace.
std::string strange_ink_profile() {
  cmsHPROFILE profile = cmsCreateProfilePlaceholder(nullptr);
  cmsSetProfileVersion(profile, 2.1);
  cmsSetDeviceClass(profile, cmsSigOutputClass);
  cmsSetColorSpace(profile, cmsSigCmykData);
  cmsSetPCS(profile, cmsSigLabData);
  cmsPipeline* pipeline = cmsPipelineAlloc(nullptr, 4, 3);
  cmsStage* table = cmsStageAllocCLut16bit(nullptr, 2, 4, 3, nullptr);
  cmsStageSampleCLut16bit(
      table,
      [](const cmsUInt16Number in[], cmsUInt16Number out[], void*) -> cmsInt32Number {
        out[0] = static_cast<cmsUInt16Number>(0xFF00U * (65535U - in[0]) / 65535U), out[1] = out[2] = 0x8000;
        return TRUE;
      },
      nullptr, 0);
  cmsPipelineInsertStage(pipeline, cmsAT_END, table);
  cmsWriteTag(profile, cmsSigAToB0Tag, pipeline);
  cmsLinkTag(profile, cmsSigAToB1Tag, cmsSigAToB0Tag);
  cmsPipelineFree(pipeline);
  return saved(profile);
}

// As Adobe's programs write it: 0 = full ink. JCS_YCCK keeps brightness and colour apart, as for a screen.
std::string cmyk_jpeg(const cv::Vec4b& inks, const std::string& icc_profile, J_COLOR_SPACE stored_as = JCS_CMYK) {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  encoder.err = jpeg_std_error(&errors);
  jpeg_create_compress(&encoder);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&encoder, &bytes, &size);
  encoder.image_width = 16, encoder.image_height = 8, encoder.input_components = 4;
  encoder.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&encoder);
  jpeg_set_colorspace(&encoder, stored_as);
  jpeg_set_quality(&encoder, 100, TRUE);
  encoder.write_Adobe_marker = TRUE;
  jpeg_start_compress(&encoder, TRUE);
  if (!icc_profile.empty())
    jpeg_write_icc_profile(&encoder, reinterpret_cast<const JOCTET*>(icc_profile.data()),
                           static_cast<unsigned>(icc_profile.size()));
  cv::Mat row(1, 16, CV_8UC4, cv::Scalar::all(255) - cv::Scalar(inks));
  while (encoder.next_scanline < encoder.image_height) {
    JSAMPROW at = row.ptr();
    jpeg_write_scanlines(&encoder, &at, 1);
  }
  jpeg_finish_compress(&encoder);
  jpeg_destroy_compress(&encoder);
  const std::string out(reinterpret_cast<char*>(bytes), size);
  std::free(bytes);
  return out;
}

void expect_colour(const Result<cv::Mat>& loaded, const cv::Vec3b& bgr, int tolerance = 1) {
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  ASSERT_EQ(loaded->type(), CV_8UC3);
  const auto got = loaded->at<cv::Vec3b>(1, 1);
  EXPECT_LE(cv::norm(got, bgr, cv::NORM_INF), tolerance) << got << " instead of " << bgr;
}

TEST_F(Pictures, OfAnyDepthBecomeEightBitColour) {
  expect_colour(load_picture(picture("grey.png", cv::Mat(4, 6, CV_8UC1, cv::Scalar(77)))), {77, 77, 77}, 0);
  const cv::Mat deep(4, 6, CV_16UC3, cv::Scalar(257 * 10, 257 * 20, 257 * 30));
  expect_colour(load_picture(picture("deep.png", deep)), {10, 20, 30}, 0);
  expect_colour(load_picture(picture("deep.tif", deep)), {10, 20, 30}, 0);
  expect_colour(load_picture(picture("deep_grey.png", cv::Mat(4, 6, CV_16UC1, cv::Scalar(65535)))), {255, 255, 255}, 0);
  // OpenCV packs it as LogLuv, which is a little lossy.
  expect_colour(load_picture(picture("float.tif", cv::Mat(4, 6, CV_32FC3, cv::Scalar(0.2, 0.4, 7)))), {51, 102, 255},
                3);
  cv::Mat drawing(4, 6, CV_8UC1, cv::Scalar(255));
  drawing.at<std::uint8_t>(1, 1) = 0;
  const auto line = load_picture(picture("drawing.png", drawing, {cv::IMWRITE_PNG_BILEVEL, 1}));
  expect_colour(line, {0, 0, 0}, 0);
  EXPECT_EQ(line->at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
  expect_colour(load_picture(picture("dot.png", cv::Mat(2, 2, CV_8UC1, cv::Scalar(9)))), {9, 9, 9}, 0);
}

TEST_F(Pictures, ShowWhiteWhereTheyAreTransparent) {
  cv::Mat alpha(4, 6, CV_8UC4, cv::Scalar(10, 20, 30, 0));
  alpha.at<cv::Vec4b>(1, 1) = {10, 20, 30, 255};
  alpha.at<cv::Vec4b>(2, 2) = {10, 20, 30, 51};
  for (const char* name : {"alpha.png", "alpha.webp"}) {
    const auto loaded = load_picture(picture(name, alpha, {cv::IMWRITE_WEBP_QUALITY, 101}));
    expect_colour(loaded, {10, 20, 30});
    EXPECT_EQ(loaded->at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255)) << name;
    EXPECT_LE(cv::norm(loaded->at<cv::Vec3b>(2, 2), cv::Vec3b(206, 208, 210), cv::NORM_INF), 1) << name;
  }
  cv::Mat rgba;
  cv::cvtColor(alpha, rgba, cv::COLOR_BGRA2RGBA);
  const auto loaded = load_picture(tiff("alpha.tif", rgba, [](TIFF* out) {
    const std::uint16_t straight = EXTRASAMPLE_UNASSALPHA;
    TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
    TIFFSetField(out, TIFFTAG_EXTRASAMPLES, 1, &straight);
  }));
  expect_colour(loaded, {10, 20, 30});
  EXPECT_EQ(loaded->at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
  EXPECT_LE(cv::norm(loaded->at<cv::Vec3b>(2, 2), cv::Vec3b(206, 208, 210), cv::NORM_INF), 2);
}

TEST_F(Pictures, StandUprightWhateverTheCameraNoted) {
  // Stored: black first pixel block, grey along the rest of the first row, white below. EXIF says where the first row
  // and the first column are to be shown.
  cv::Mat stored(32, 48, CV_8UC3, cv::Scalar::all(255));
  stored(cv::Rect(0, 0, 48, 16)).setTo(cv::Scalar::all(128));
  stored(cv::Rect(0, 0, 16, 16)).setTo(cv::Scalar::all(0));
  struct Shown {
    bool row_upright;    // the first row becomes a column
    bool right, bottom;  // the corner where the first pixel is shown
  };
  const Shown shown[9] = {{},
                          {false, false, false},
                          {false, true, false},
                          {false, true, true},
                          {false, false, true},
                          {true, false, false},
                          {true, true, false},
                          {true, true, true},
                          {true, false, true}};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const Shown& want = shown[orientation];
    std::string jpeg = encoded(".jpg", stored), png = encoded(".png", stored);
    jpeg.insert(2, jpeg_segment('\xE1', std::string("Exif\0\0", 6) + exif(orientation)));
    png = with_chunk(png, png_chunk("eXIf", exif(orientation)));
    const auto tagged = tiff("turned.tif", stored, [&](TIFF* out) {
      TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
      TIFFSetField(out, TIFFTAG_ORIENTATION, orientation);
    });
    for (const auto& loaded : {decode_picture(jpeg, "a.jpg"), decode_picture(png, "a.png"), load_picture(tagged)}) {
      ASSERT_TRUE(loaded.ok());
      const int width = want.row_upright ? 32 : 48, height = want.row_upright ? 48 : 32;
      ASSERT_EQ(loaded->size(), cv::Size(width, height)) << orientation;
      const cv::Point corner(want.right ? width - 4 : 4, want.bottom ? height - 4 : 4);
      const cv::Point along =
          want.row_upright ? cv::Point(corner.x, height - corner.y) : cv::Point(width - corner.x, corner.y);
      EXPECT_LT(loaded->at<cv::Vec3b>(corner)[0], 40) << orientation;
      EXPECT_NEAR(loaded->at<cv::Vec3b>(along)[0], 128, 20) << orientation;
      EXPECT_GT(loaded->at<cv::Vec3b>(height - corner.y, width - corner.x)[0], 220) << orientation;
    }
  }
}

// The scanner's map belongs to the glass: whatever a program would turn, the first pixel stays where it was scanned.
TEST_F(Pictures, OfAScannerLieAsTheyWereScanned) {
  cv::Mat stored(32, 48, CV_8UC3, cv::Scalar::all(255));
  stored(cv::Rect(0, 0, 16, 16)).setTo(cv::Scalar::all(0));
  for (int orientation = 1; orientation <= 8; ++orientation) {
    std::string jpeg = encoded(".jpg", stored), png = encoded(".png", stored);
    jpeg.insert(2, jpeg_segment('\xE1', std::string("Exif\0\0", 6) + exif(orientation)));
    png = with_chunk(png, png_chunk("eXIf", exif(orientation)));
    const auto tagged = tiff("turned.tif", stored, [&](TIFF* out) {
      TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
      TIFFSetField(out, TIFFTAG_ORIENTATION, orientation);
    });
    for (const fs::path& path : {file("a.jpg", jpeg), file("a.png", png), fs::path(tagged)}) {
      const auto scan = load_scan(path);
      ASSERT_TRUE(scan.ok()) << scan.error().message;
      ASSERT_EQ(scan->pixels.size(), stored.size()) << path << orientation;
      EXPECT_LT(scan->pixels.at<cv::Vec3b>(4, 4)[0], 40) << path << orientation;
      EXPECT_GT(scan->pixels.at<cv::Vec3b>(28, 44)[0], 220) << path << orientation;
    }
  }
}

TEST_F(Pictures, TellTheResolutionThatTheirFileSays) {
  using std::string_literals::operator""s;
  const cv::Mat stored(8, 8, CV_8UC3, cv::Scalar::all(90));
  const auto with_resolution = [&](float x, float y, int unit) {
    return tiff("scan.tif", stored, [=](TIFF* out) {
      TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
      TIFFSetField(out, TIFFTAG_XRESOLUTION, x), TIFFSetField(out, TIFFTAG_YRESOLUTION, y);
      TIFFSetField(out, TIFFTAG_RESOLUTIONUNIT, unit);
    });
  };
  // OpenCV writes a JFIF block without a unit: the same with one for an inch, 300 and 301.
  std::string jpeg = encoded(".jpg", stored);
  ASSERT_EQ(jpeg.substr(6, 5), "JFIF\0"s);
  jpeg.replace(13, 5, "\x01"s + big_endian(300, 2) + big_endian(301, 2));
  const std::string plain = encoded(".png", stored);
  const std::string png = with_chunk(plain, png_chunk("pHYs", big_endian(11811, 4) + big_endian(23622, 4) + "\x01"s));
  const std::string aspect = with_chunk(plain, png_chunk("pHYs", big_endian(1, 4) + big_endian(1, 4) + "\0"s));
  const auto said = [](const fs::path& path) {
    const auto scan = load_scan(path);
    return scan ? std::pair(std::round(scan->dpi_x * 10) / 10, std::round(scan->dpi_y * 10) / 10)
                : std::pair(-1.0, -1.0);
  };
  EXPECT_EQ(said(file("a.jpg", jpeg)), std::pair(300.0, 301.0));
  EXPECT_EQ(said(file("a.png", png)), std::pair(300.0, 600.0));
  EXPECT_EQ(said(file("b.png", aspect)), std::pair(0.0, 0.0));
  EXPECT_EQ(said(file("c.png", plain)), std::pair(0.0, 0.0));
  EXPECT_EQ(said(with_resolution(240, 240, RESUNIT_INCH)), std::pair(240.0, 240.0));
  EXPECT_EQ(said(with_resolution(100, 100, RESUNIT_CENTIMETER)), std::pair(254.0, 254.0));
  EXPECT_EQ(said(with_resolution(100, 100, RESUNIT_NONE)), std::pair(0.0, 0.0));
}

// The oldest headers of BMP have short sides; what stands where newer ones have a resolution are pixels.
TEST_F(Pictures, OfTheOldestBitmapsHaveNoResolution) {
  std::string bmp;
  bmp.append("BM").append(12, '\0').append(little_endian(12, 4)).append(little_endian(40000, 2));
  bmp.append(little_endian(20000, 2)).append(little_endian(1, 2)).append(little_endian(24, 2)).append(64, '\x21');
  const auto loaded = decode_picture(bmp, "bitmap");
  ASSERT_FALSE(loaded.ok());
  EXPECT_THAT(loaded.error().message, HasSubstr("bitmap has 40000 x 20000 pixels"));
  EXPECT_EQ(picture_metadata(bmp).dpi_x, 0);
}

TEST_F(Pictures, KeepTheResolutionOfTheirExifBeforeABlockThatSaysNone) {
  std::string jpeg = encoded(".jpg", cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(90)));
  jpeg.insert(2, jpeg_segment('\xE1', std::string("Exif\0\0", 6) + exif_resolution(kRationalType)));
  const auto scan = load_scan(file("a.jpg", jpeg));
  ASSERT_TRUE(scan.ok()) << scan.error().message;
  EXPECT_EQ(scan->dpi_x, 300);
}

// A value of another type is not the place of a fraction.
TEST_F(Pictures, TakeNoResolutionOfAWrongType) {
  for (const int type : {1, 3, 4, 7}) EXPECT_EQ(picture_metadata(exif_resolution(type)).dpi_x, 0) << type;
  EXPECT_EQ(picture_metadata(exif_resolution(kRationalType)).dpi_x, 300);
}

TEST_F(Pictures, AreConvertedFromTheirProfileToSrgb) {
  const cv::Mat half(8, 8, CV_8UC3, cv::Scalar::all(128));
  const std::string profile = linear_rgb_profile();
  std::string jpeg = encoded(".jpg", half);
  const std::string head("ICC_PROFILE\0", 12);
  const std::size_t middle = profile.size() / 2;
  jpeg.insert(2, jpeg_segment('\xE2', head + "\x01\x02" + profile.substr(0, middle)) +
                     jpeg_segment('\xE2', head + "\x02\x02" + profile.substr(middle)));
  expect_colour(decode_picture(jpeg, "a.jpg"), cv::Vec3b::all(kHalfTheLight), 2);

  const std::string chunk = png_chunk("iCCP", std::string("p\0\0", 3) + deflated(profile));
  expect_colour(decode_picture(with_chunk(encoded(".png", half), chunk), "a.png"), cv::Vec3b::all(kHalfTheLight));
  const cv::Mat deep(8, 8, CV_16UC3, cv::Scalar::all(32896));
  expect_colour(decode_picture(with_chunk(encoded(".png", deep), chunk), "b.png"), cv::Vec3b::all(kHalfTheLight));

  const std::string grey_chunk = png_chunk("iCCP", std::string("p\0\0", 3) + deflated(linear_grey_profile()));
  const cv::Mat grey(8, 8, CV_8UC1, cv::Scalar(128));
  expect_colour(decode_picture(with_chunk(encoded(".png", grey), grey_chunk), "c.png"), cv::Vec3b::all(kHalfTheLight));
  // A profile for other pictures, or a broken one, changes nothing.
  expect_colour(decode_picture(with_chunk(encoded(".png", half), grey_chunk), "d.png"), cv::Vec3b::all(128));
  const std::string broken = png_chunk("iCCP", std::string("p\0\0", 3) + "nonsense");
  expect_colour(decode_picture(with_chunk(encoded(".png", half), broken), "e.png"), cv::Vec3b::all(128));

  expect_colour(decode_picture(webp_with_profile(half, profile), "a.webp"), cv::Vec3b::all(kHalfTheLight), 3);

  const auto tagged = tiff("profile.tif", half, [&](TIFF* out) {
    TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
    TIFFSetField(out, TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(profile.size()), profile.data());
  });
  expect_colour(load_picture(tagged), cv::Vec3b::all(kHalfTheLight));
}

TEST_F(Pictures, MadeForPrintAreReadByTheirInks) {
  expect_colour(decode_picture(cmyk_jpeg({255, 0, 0, 0}, ""), "cyan.jpg"), {255, 255, 0}, 3);
  expect_colour(decode_picture(cmyk_jpeg({0, 255, 0, 128}, ""), "dark.jpg"), {127, 0, 127}, 3);
  expect_colour(decode_picture(cmyk_jpeg({0, 255, 0, 128}, "", JCS_YCCK), "photoshop.jpg"), {127, 0, 127}, 4);
  const std::string profile = strange_ink_profile();
  expect_colour(decode_picture(cmyk_jpeg({255, 0, 0, 0}, profile), "a.jpg"), {0, 0, 0}, 3);
  expect_colour(decode_picture(cmyk_jpeg({0, 255, 0, 255}, profile), "b.jpg"), {255, 255, 255}, 3);

  const auto inks = [&](std::uint32_t size) {
    return [&, size](TIFF* out) {
      TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_SEPARATED);
      if (size > 0) TIFFSetField(out, TIFFTAG_ICCPROFILE, size, profile.data());
    };
  };
  const cv::Mat cyan(8, 8, CV_8UC4, cv::Scalar(255, 0, 0, 0)), deep(8, 8, CV_16UC4, cv::Scalar(65535, 0, 0, 0));
  expect_colour(load_picture(tiff("cyan.tif", cyan, inks(0))), {255, 255, 0});
  expect_colour(load_picture(tiff("deep.tif", deep, inks(0))), {255, 255, 0});
  expect_colour(load_picture(tiff("profile.tif", cyan, inks(static_cast<std::uint32_t>(profile.size())))), {0, 0, 0});
}

TEST_F(Pictures, ThatCannotBeReadAreRefusedWithARemedy) {
  EXPECT_EQ(load_picture(folder_ / "none.png").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(load_picture(folder_).error().code, ErrorCode::kInvalidArgument);
  const auto refusal = [&](const std::string& name, const std::string& bytes) {
    const auto loaded = load_picture(file(name, bytes));
    EXPECT_FALSE(loaded.ok()) << name;
    return loaded.ok() ? std::string() : loaded.error().message;
  };
  EXPECT_THAT(refusal("text.png", "not a picture"), HasSubstr("not a picture that can be read: save it as PNG"));
  EXPECT_THAT(refusal("empty.png", ""), HasSubstr("empty"));
  EXPECT_THAT(refusal("phone.heic", std::string("\0\0\0\x18", 4) + "ftypheic" + std::string(20, 'x')),
              HasSubstr("HEIF"));
  EXPECT_THAT(refusal("drawing.svg", "<?xml version=\"1.0\"?><svg></svg>"), HasSubstr("SVG drawing"));
  EXPECT_THAT(refusal("paper.pdf", "%PDF-1.4"), HasSubstr("PDF"));
  cv::Mat noise(64, 64, CV_8UC3);
  cv::randu(noise, 0, 255);
  for (const char* format : {".png", ".jpg", ".webp"}) {
    const std::string whole = encoded(format, noise);
    EXPECT_THAT(refusal(std::string("cut") + format, whole.substr(0, whole.size() / 2)), HasSubstr("damaged"));
  }
}

// Where the decoder would fill up with grey and only warn.
TEST_F(Pictures, OfWhichAPartIsMissingAreRefusedEvenWithAnEndMark) {
  cv::Mat noise(64, 64, CV_8UC3);
  cv::randu(noise, 0, 255);
  const std::string whole = encoded(".jpg", noise);
  for (const double part : {0.5, 0.9}) {
    const auto loaded = decode_picture(
        whole.substr(0, static_cast<std::size_t>(part * static_cast<double>(whole.size()))) + "\xFF\xD9", "photo.jpg");
    ASSERT_FALSE(loaded.ok()) << part;
    EXPECT_THAT(loaded.error().message, HasSubstr("photo.jpg is damaged: open it in a picture program"));
  }
  EXPECT_TRUE(decode_picture(whole, "photo.jpg").ok());
}

// OpenCV leaves out the rows of a strip that does not unpack, and says nothing.
TEST_F(Pictures, InTiffFilesThatAreSpoiltOrCutShortAreRefused) {
  cv::Mat wood(400, 300, CV_8UC3), deep, grey;
  cv::RNG random(3);
  random.fill(wood, cv::RNG::NORMAL, 120, 8);
  wood.convertTo(deep, CV_16U, 257);
  cv::cvtColor(wood, grey, cv::COLOR_BGR2GRAY);
  for (const cv::Mat& samples : {wood, deep, grey})
    for (const int rows : {16, samples.rows}) {
      const auto scan = tiff("scan.tif", samples, [&](TIFF* out) {
        TIFFSetField(out, TIFFTAG_PHOTOMETRIC, samples.channels() == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
        TIFFSetField(out, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
        TIFFSetField(out, TIFFTAG_ROWSPERSTRIP, rows);
      });
      const std::string whole = read_whole(scan).value_or("");
      ASSERT_TRUE(decode_picture(whole, "scan.tif").ok());
      std::string spoilt = whole;
      std::fill_n(spoilt.begin() + static_cast<std::ptrdiff_t>(whole.size() / 2), 40, '\xff');
      for (const std::string& bytes : {spoilt, whole.substr(0, whole.size() * 6 / 10)}) {
        const auto loaded = decode_picture(bytes, "scan.tif");
        ASSERT_FALSE(loaded.ok()) << samples.type() << " in strips of " << rows;
        EXPECT_THAT(loaded.error().message, HasSubstr("scan.tif is damaged: open it in a picture program"));
      }
    }
}

// A kilobyte may claim gigabytes of pixels. These files hold none: whoever unpacked them would find them damaged.
TEST_F(Pictures, OfAbsurdSizeAreRefusedByWhatTheySayOfThemselves) {
  // Appended piece by piece: g++ 12 sees writes beyond the end in sums of short texts.
  const auto joined = [](std::initializer_list<std::string> parts) {
    std::string out;
    for (const auto& part : parts) out += part;
    return out;
  };
  const std::string zeros(16, '\0');
  const auto png = [&](std::size_t width, std::size_t height, char bits, char colours) {
    std::string header = joined({big_endian(width, 4), big_endian(height, 4)});
    header.push_back(bits);
    header.push_back(colours);
    return joined({"\x89PNG\r\n\x1A\n", png_chunk("IHDR", header.append(3, '\0'))});
  };
  const std::string jpeg =
      joined({"\xFF\xD8", jpeg_segment('\xC0', joined({"\x08", big_endian(65000, 2), big_endian(65000, 2),
                                                       "\x01\x01\x11", zeros.substr(15)}))});
  const auto entry = [&](std::size_t tag, std::size_t value) {
    return joined({little_endian(tag, 2), little_endian(4, 2), little_endian(1, 4), little_endian(value, 4)});
  };
  const std::string tiff = joined({"II*", zeros.substr(15), little_endian(8, 4), little_endian(2, 2),
                                   entry(0x100, 100000), entry(0x101, 100000), zeros.substr(12)});
  const std::string bmp = joined({"BM", zeros, little_endian(40000, 4), little_endian(0xFFFF63C0, 4)});
  for (const auto& [size, bytes] :
       std::vector<std::pair<std::string, std::string>>{{"30000 x 30000", png(30000, 30000, 8, 0)},
                                                        {"19000 x 19000", png(19000, 19000, 16, 6)},
                                                        {"4294967295 x 4294967295", png(0xFFFFFFFF, 0xFFFFFFFF, 8, 0)},
                                                        {"65000 x 65000", jpeg},
                                                        {"100000 x 100000", tiff},
                                                        {"40000 x 40000", bmp}}) {
    const auto loaded = decode_picture(bytes, "bomb");
    ASSERT_FALSE(loaded.ok()) << size;
    EXPECT_THAT(loaded.error().message, HasSubstr("bomb has " + size + " pixels, more than 300 million: make it"));
    const auto mask = load_mask(file("bomb", bytes));
    ASSERT_FALSE(mask.ok()) << size;
    EXPECT_THAT(mask.error().message, HasSubstr(size));
  }
  const auto panel = decode_picture(png(20000, 14000, 8, 2), "panel");
  ASSERT_FALSE(panel.ok());
  EXPECT_THAT(panel.error().message, HasSubstr("damaged")) << "not refused for its size";
}

// A picture for print that says it has no rows: nothing to decode, and nothing to look at.
TEST_F(Pictures, WithoutAPixelAreRefused) {
  const auto inks = tiff("inks.tif", cv::Mat(6, 6, CV_8UC4, cv::Scalar(1, 2, 3, 4)),
                         [](TIFF* out) { TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_SEPARATED); });
  std::string bytes = read_whole(inks).value_or("");
  const std::string rows = little_endian(0x101, 2) + little_endian(3, 2) + little_endian(1, 4);
  const std::size_t at = bytes.find(rows);
  ASSERT_NE(at, std::string::npos);
  bytes[at + 8] = '\0';
  const auto picture = decode_picture(bytes, "inks");
  ASSERT_FALSE(picture.ok());
  EXPECT_THAT(picture.error().message, HasSubstr("inks is damaged"));
  const auto mask = load_mask(file("mask.tif", bytes));
  ASSERT_FALSE(mask.ok());
  EXPECT_THAT(mask.error().message, HasSubstr("is damaged"));
}

// Whatever bytes come, the answer is a picture or a sentence.
TEST_F(Pictures, SurviveDamagedFiles) {
  cv::Mat noise(12, 10, CV_8UC3);
  cv::randu(noise, 0, 255);
  std::string jpeg = encoded(".jpg", noise);
  jpeg.insert(2, jpeg_segment('\xE1', std::string("Exif\0\0", 6) + exif(6)));
  const std::string profile = linear_rgb_profile();
  const std::string png =
      with_chunk(encoded(".png", noise), png_chunk("iCCP", std::string("p\0\0", 3) + deflated(profile)));
  const auto inks = tiff("inks.tif", cv::Mat(6, 6, CV_8UC4, cv::Scalar(1, 2, 3, 4)),
                         [](TIFF* out) { TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_SEPARATED); });
  const std::string tiff_bytes = read_whole(inks).value_or("");
  TIFFSetErrorHandler(nullptr);
  TIFFSetWarningHandler(nullptr);
  cv::RNG random(5);
  int read = 0;
  for (const std::string& good : {jpeg, png, tiff_bytes, cmyk_jpeg({9, 9, 9, 9}, profile)}) {
    for (int i = 0; i < 400; ++i) {
      std::string bytes = good;
      for (int hits = random.uniform(1, 6); hits > 0; --hits)
        bytes[static_cast<std::size_t>(random.uniform(0, std::min(900, static_cast<int>(bytes.size()))))] =
            static_cast<char>(random.uniform(0, 256));
      const auto loaded = decode_picture(bytes, "damaged");
      if (loaded.ok()) {
        ++read;
        EXPECT_EQ(loaded->type(), CV_8UC3);
      } else {
        EXPECT_EQ(loaded.error().code, ErrorCode::kInvalidArgument);
      }
      const auto mask = load_mask(file("mask", bytes));
      if (!mask.ok()) {
        EXPECT_EQ(mask.error().code, ErrorCode::kInvalidArgument);
      }
    }
  }
  EXPECT_GT(read, 100);
}

// A panel's picture and its mask, each as every viewer shows it, lie on each other.
TEST_F(Pictures, MasksStandUprightAsTheirPanelsDo) {
  cv::Mat corner(16, 24, CV_8UC3, cv::Scalar::all(0));
  corner(cv::Rect(0, 0, 8, 8)).setTo(cv::Scalar::all(255));
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const auto path = folder_ / "turned.png";
    std::ofstream(path, std::ios::binary) << with_chunk(encoded(".png", corner), png_chunk("eXIf", exif(orientation)));
    const auto turned_tiff = tiff("turned.tif", corner, [&](TIFF* out) {
      TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
      TIFFSetField(out, TIFFTAG_ORIENTATION, orientation);
    });
    for (const auto& file : {path, turned_tiff}) {
      const auto shown = load_picture(file), mask = load_mask(file);
      ASSERT_TRUE(shown.ok() && mask.ok()) << orientation;
      cv::Mat first;
      cv::extractChannel(*shown, first, 0);
      ASSERT_EQ(mask->size(), first.size()) << orientation;
      EXPECT_EQ(cv::norm(*mask, first, cv::NORM_INF), 0) << file << " " << orientation;
    }
  }
}

TEST_F(Pictures, MasksAreNonZeroWhereAnyColourIs) {
  cv::Mat mask(2, 3, CV_8UC4, cv::Scalar(0, 0, 0, 255));
  mask.at<cv::Vec4b>(1, 2) = {0, 1, 0, 255};
  const auto loaded = load_mask(picture("mask.png", mask));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(cv::countNonZero(*loaded), 1);
  EXPECT_EQ(loaded->at<std::uint8_t>(1, 2), 255);
}

}  // namespace
}  // namespace veneer::planner
