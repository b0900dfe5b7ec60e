/* One byte on UART 1 with the receiver on, one with it off, one with it on. */
#include <avr/io.h>

#define LOG ((volatile uint8_t *)0x3F00)

static void send(uint8_t byte) {
    UCSR1A |= _BV(TXC1);
    UDR1 = byte;
    while (!(UCSR1A & _BV(TXC1))) {}
    if (UCSR1A & _BV(RXC1)) LOG[++LOG[0]] = UDR1;
}

int main(void) {
    LOG[0] = 0;
    UCSR1A = _BV(U2X1);
    UBRR1 = 1;
    UCSR1B = _BV(RXEN1) | _BV(TXEN1);
    send(1);
    UCSR1B = _BV(TXEN1);
    send(2);
    UCSR1B = _BV(RXEN1) | _BV(TXEN1);
    send(3);
    for (;;) {}
}
