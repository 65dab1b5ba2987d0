/* SPDX-License-Identifier: MIT */
/* A driver of a PCI card with four registers: what it is, a counter, an input, an output. Takes the first card, declines a second one. */
#include "linuxcnc.h"

struct id {
    uint32_t vendor, device, subvendor, subdevice, kind, kind_mask;
};
struct bar {
    intptr_t start, end;
    unsigned long flags;
    void* mapped;
};
struct device {
    char name[32], path[256];
    uint16_t vendor, device, subvendor, subdevice;
    uint32_t kind;
    struct bar bars[6];
    void* data;
};
struct driver {
    const char* name;
    const struct id* ids;
    int (*probe)(struct device*, const struct id*);
    void (*remove)(struct device*);
    void* more;
};
int rtapi_pci_register_driver(struct driver*);
void rtapi_pci_unregister_driver(struct driver*);
int rtapi_pci_enable_device(struct device*);
int rtapi_pci_disable_device(struct device*);
void* rtapi_pci_ioremap_bar(struct device*, int number);
void rtapi_iounmap(void*);

struct pins {
    volatile uint32_t *cycles, *in, *out;
};
static struct pins* pins;
static volatile uint32_t* registers;
static int comp, number_of_bar, fails;
PARAMETER(fails, "i", "fail after the card was found, and give nothing back")
PARAMETER(number_of_bar, "i", "the region of memory")

static void update(void* unused, long period) {
    (void)unused, (void)period;
    registers[1] = ++*pins->cycles;
    *pins->in = registers[2];
    registers[3] = *pins->out;
}

static int probe(struct device* device, const struct id* id) {
    rtapi_print("card: %s %04x:%04x %04x:%04x class %06x, row for %x, %ld bytes\n", device->name,
                device->vendor, device->device, device->subvendor, device->subdevice, device->kind,
                id->subdevice,
                (long)(device->bars[number_of_bar].end - device->bars[number_of_bar].start + 1));
    if (registers) return -16;
    const int enabled = rtapi_pci_enable_device(device);
    if (enabled) return enabled;
    registers = rtapi_pci_ioremap_bar(device, number_of_bar);
    if (!registers) return -19;
    if (registers[0] == 0xca4d) return 0;
    rtapi_iounmap((void*)registers);
    registers = 0;
    return -19;
}
static void removed(struct device* device) {
    registers[1] = 0;
    rtapi_iounmap((void*)registers);
    rtapi_pci_disable_device(device);
}

static const struct id ids[] = {{0x2718, 0x5125, 0x2718, 0x3427, 0, 0},
                                {0x2718, 0x5125, 0xffffffff, 0xffffffff, 0x118000, 0xffff00},
                                {0}};
static struct driver driver = {"card", ids, probe, removed, 0};

int rtapi_app_main(void) {
    comp = hal_init("card");
    pins = hal_malloc(sizeof *pins);
    hal_pin_u32_newf(OUT, &pins->cycles, comp, "card.cycles");
    hal_pin_u32_newf(OUT, &pins->in, comp, "card.in");
    hal_pin_u32_newf(IN, &pins->out, comp, "card.out");
    hal_export_funct("card", update, 0, 0, 0, comp);
    const int result = rtapi_pci_register_driver(&driver);
    if (fails) return -5;
    if (result != 0 || !registers) {
        if (result == 0) {
            rtapi_pci_unregister_driver(&driver);
        }
        hal_exit(comp);
        return result ? result : -19;
    }
    return hal_ready(comp);
}
void rtapi_app_exit(void) {
    rtapi_pci_unregister_driver(&driver);
    hal_exit(comp);
}
