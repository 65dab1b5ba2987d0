hal can eds check eds-unreadable.eds
