// Which USB devices a scanner may be, on a picture of the kernel's list of them.
#include "daemon/devices/usb_devices.h"

#include <gmock/gmock.h>

#include <fstream>
#include <string>

#include "tests/support/temp_directory.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;
using ::testing::UnorderedElementsAre;

class UsbDevices : public ::testing::Test {
 protected:
  void SetUp() override {
    plug("usb1", 1, "1d6b", "0002");
    plug("usb1/1-1", 7, "04b8", "013a");   // a scanner
    plug("usb1/1-2", 12, "1a86", "7523");  // a GRBL controller's adapter
    plug("usb1/1-3", 9, "2341", "0043");   // another one's
    plug("usb1/1-4", 10, "1a86", "5512");  // a Lihuiyu board
    make_tty("usb1/1-2/1-2:1.0/ttyUSB0/tty/ttyUSB0", "ttyUSB0", "usb1/1-2/1-2:1.0/ttyUSB0");
    make_tty("usb1/1-3/1-3:1.0/tty/ttyACM0", "ttyACM0", "usb1/1-3/1-3:1.0");
    make_tty("platform/serial8250/tty/ttyS0", "ttyS0", "platform/serial8250");
    fs::create_directories(dev_ / "veneer");
    for (const char* name : {"ttyUSB0", "ttyACM0", "ttyS0"}) std::ofstream(dev_ / name).flush();
    fs::create_symlink("../ttyUSB0", dev_ / "veneer/laser-pci-0000_00_14_0-usb-0_2_1_0");
  }

  // As the kernel does: /sys/bus/usb/devices are links to where each is plugged in.
  void plug(const std::string& at, int number, const char* vendor, const char* product) {
    const fs::path place = sys_ / "devices" / at;
    fs::create_directories(place);
    std::ofstream(place / "busnum") << "1\n";
    std::ofstream(place / "devnum") << number << "\n";
    std::ofstream(place / "idVendor") << vendor << "\n";
    std::ofstream(place / "idProduct") << product << "\n";
    fs::create_directories(sys_ / "bus/usb/devices");
    fs::create_symlink(place, sys_ / "bus/usb/devices" / place.filename());
  }
  void make_tty(const std::string& at, const std::string& name, const std::string& device) {
    const fs::path place = sys_ / "devices" / at;
    fs::create_directories(place);
    fs::create_symlink(sys_ / "devices" / device, place / "device");
    fs::create_directories(sys_ / "class/tty");
    fs::create_symlink(place, sys_ / "class/tty" / name);
  }
  std::vector<std::string> numbers(const std::string& laser_port) const {
    std::vector<std::string> out;
    for (const fs::path& file : usb_devices_but_lasers(laser_port, sys_.path())) {
      EXPECT_EQ(file.parent_path(), "/dev/bus/usb/001");
      out.push_back(file.filename());
    }
    return out;
  }
  std::string port(const std::string& name, const char* options = "") const {
    return "serial:" + (dev_ / name).string() + options;
  }

  testing::TempDirectory sys_, dev_;
};

TEST_F(UsbDevices, AreAllButLihuiyuBoards) {
  EXPECT_THAT(numbers(""), UnorderedElementsAre("001", "007", "012", "009"));
  EXPECT_THAT(numbers("usb:1a86:5512"), UnorderedElementsAre("001", "007", "012", "009"));
  EXPECT_THAT(numbers("tcp:127.0.0.1:2000"), UnorderedElementsAre("001", "007", "012", "009"));
}

TEST_F(UsbDevices, AndButTheAdapterOfTheLasersSerialPort) {
  EXPECT_THAT(numbers(port("ttyUSB0")), UnorderedElementsAre("001", "007", "009"));
  EXPECT_THAT(numbers(port("ttyUSB0", "?baud=115200")), UnorderedElementsAre("001", "007", "009"));
  EXPECT_THAT(numbers(port("ttyACM0")), UnorderedElementsAre("001", "007", "012"));
}

TEST_F(UsbDevices, ByWhateverNameItIsConfigured) {
  EXPECT_THAT(numbers(port("veneer/laser-pci-0000_00_14_0-usb-0_2_1_0", "?baud=250000")),
              UnorderedElementsAre("001", "007", "009"));
}

TEST_F(UsbDevices, AreAllOfThemWhereThePortIsNoUsbDevice) {
  EXPECT_THAT(numbers(port("ttyS0")), UnorderedElementsAre("001", "007", "012", "009"));
  EXPECT_THAT(numbers(port("ttyUSB7")), UnorderedElementsAre("001", "007", "012", "009")) << "it is not plugged in";
}

}  // namespace
}  // namespace veneer::daemon
